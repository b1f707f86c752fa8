# run · test · check · bench · mutants · soak · simulation · controllers · lock — each does its own set-up.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.PHONY: run setup test pytest check bench mutants soak simulation simulated-study controllers lock clean

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DATA ?= $(or $(JOYMAP_DATA_DIR),data)
PANDA := $(or $(JOYMAP_PANDA_DIR),$(DATA)/panda)
PIP := $(BIN)/pip --disable-pip-version-check
# Python compiles what it imports; compiling all the rest beforehand takes most of a minute.
INSTALL := $(PIP) install --no-compile --progress-bar on
# For that to hold, what is compiled must be kept, wherever the environment (of a container, say) says not to.
export PYTHONDONTWRITEBYTECODE :=
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Two cores are shared by the control loop and the trainings: one thread for each library.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1

run: setup
	exec $(BIN)/joymap serve

setup: $(VENV)/.run $(PANDA)/manifest.json

$(VENV)/bin/python:
	@echo "── Joymap: making the virtual environment in $(VENV)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "Joymap needs Python 3.11 or newer (PYTHON=…)." >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) \
	  || { echo "The venv module is missing; on Debian: apt install python3-venv." >&2; exit 1; }

$(VENV)/.run: requirements/run.lock pyproject.toml | $(VENV)/bin/python
	@echo "── Joymap: installing what it needs (once; a few minutes)"
	$(INSTALL) -r requirements/run.lock
	$(PIP) install --quiet --no-deps -e .
	@touch $@

$(VENV)/.test: requirements/test.lock $(VENV)/.run
	@echo "── Joymap: installing what the tests need"
	$(INSTALL) -r requirements/test.lock
	@touch $@

$(PANDA)/manifest.json: requirements/panda.lock models/panda_pack.py | $(VENV)/.run
	@echo "── Joymap: fetching the arm's meshes (131 MB, once)"
	@fetched=$$(mktemp -d) && trap 'rm -rf "$$fetched"' EXIT \
	  && $(PIP) download --progress-bar on --no-deps --require-hashes \
	       -r requirements/panda.lock -d "$$fetched" \
	  && $(BIN)/python -m models.panda_pack --wheel "$$fetched"/example_robot_data-*.whl --out $(PANDA)

test: check pytest

pytest: $(VENV)/.test $(PANDA)/manifest.json
	@$(BIN)/python -m tests.browser.find_browser
	$(BIN)/python -m pytest -n 2

check: $(VENV)/.test $(PANDA)/manifest.json
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.test $(PANDA)/manifest.json
	$(BIN)/python -m tests.benchmarks

# Breaks the learning core at random, 60 times a module, and fails where its tests do not notice.
# A run that was stopped goes on where it was.
mutants: $(VENV)/.test $(PANDA)/manifest.json
	JOYMAP_PANDA_DIR=$(abspath $(PANDA)) $(BIN)/python -m tests.soak.mutants --out $(DATA)/mutants

# Three hours and the mutants: the tests that take long, hundreds of drives through a running server, a thousand
# random ones in each world, ten thousand people, trouble at every step of a study, and crowds of
# simulated participants.
soak: $(VENV)/.test $(PANDA)/manifest.json
	$(BIN)/python -m pytest -m soak
	$(BIN)/python -m tests.soak.driven_tasks
	$(BIN)/python -m tests.soak.random_drives
	$(BIN)/python -m tests.soak.many_people
	$(BIN)/python -m tests.soak.interruptions
	$(BIN)/python -m tests.soak.crowds_of_bots
	$(MAKE) mutants

# Half an hour on two cores: three studies of ten simulated people each, through a server.
STUDIES := $(DATA)/simulated-study
BOTS := $(BIN)/joymap bots --study examples/paper-study.yaml --participants 10 --parallel 10
simulated-study: setup
	mkdir -p $(STUDIES)
	$(BOTS) --seed 100 --out $(STUDIES)/first.zip
	$(BOTS) --seed 400 --out $(STUDIES)/held-out.zip
	$(BOTS) --seed 300 --same all-priors --out $(STUDIES)/same.zip
	$(BIN)/joymap study-page --first $(STUDIES)/first.zip --held-out $(STUDIES)/held-out.zip \
	  --same $(STUDIES)/same.zip --out docs/simulated-study.md

# Half an hour on two cores. A run that was stopped goes on where it was; after a change of the code,
# FRESH=--fresh begins anew.
SIMULATION := $(DATA)/simulation
SIMULATE := $(BIN)/joymap simulate $(FRESH)
PEOPLE := axes,rotated:45,mirrored,swapped,polar,expo:0.7,expo:1.5,gain:0.6,random+expo:0.7,polar+gain:0.6
simulation: setup
	$(SIMULATE) --out $(SIMULATION)/paper
	$(SIMULATE) --out $(SIMULATION)/labels --method no-priors,all-priors,task-space \
	  --labels 3,5,7,8,10,20,30 --queries random,designed
	$(SIMULATE) --out $(SIMULATION)/people --method all-priors,task-space \
	  --preference $(PEOPLE) --noise 0,0.1
	$(SIMULATE) --out $(SIMULATION)/wrong-answers --method no-priors,all-priors,task-space \
	  --noise 0.1 --wrong-answers 0,0.1,0.2
	$(SIMULATE) --out $(SIMULATION)/controllers --task plane --noise 0,0.1 \
	  --controller autoencoder,linear,principal,warped
	$(BIN)/joymap simulate-page --paper $(SIMULATION)/paper --labels $(SIMULATION)/labels \
	  --people $(SIMULATION)/people $(SIMULATION)/wrong-answers \
	  --controllers $(SIMULATION)/controllers --out docs/simulation.md

controllers: setup
	$(BIN)/python -m models.make_controllers

# Writes the lock files anew from pyproject.toml, in an environment of their own.
lock:
	$(PYTHON) requirements/lock.py

clean:
	rm -rf $(VENV) *.egg-info .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
