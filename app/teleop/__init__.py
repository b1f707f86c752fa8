"""The live arm: the control loop, one session a participant, the recorder."""
