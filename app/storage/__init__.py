"""The only room that speaks SQL; rows are ``…Row``."""
