# `make help` lists the targets.
# The first Python 3.11 to 3.13 that is there; another one: make PYTHON=/path/to/python
PYTHON ?= $(shell for python in python3.11 python3.12 python3.13 python3 python; do \
	"$$python" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2> /dev/null \
	&& echo "$$python" && break; done)
NO_PYTHON := fieldrl needs Python 3.11, 3.12 or 3.13 and found none. Install one of them, or name yours: make PYTHON=/path/to/python
BIN := .venv/bin
INSTALLED := .venv/.installed
# Compiles the inner loops of both experiments once, before all cores ask for the same ones at the same time.
WARMED := .pytest_cache/.warmed
WARM := $(BIN)/fieldrl -m experiment=advection,double_gyre episodes=2 steps=3 replicates=1 tracking=none force=true \
	output_dir=.pytest_cache/warm hydra/launcher=joblib

.DEFAULT_GOAL := help
.PHONY: help setup run paper contest test check docs ui clean

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(INSTALLED)  ## create .venv and install fieldrl in it

$(INSTALLED): pyproject.toml constraints.txt
	@test -x $(BIN)/python || { test -n "$(PYTHON)" || { echo "$(NO_PYTHON)" >&2; exit 1; }; }
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv || { rm -rf .venv; exit 1; }
	@echo "Installing fieldrl and its dependencies in .venv (about a minute) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev,paper]'
	@touch $@

run: $(INSTALLED)  ## run the default experiment
	@$(BIN)/fieldrl

paper: $(INSTALLED)  ## every figure and table of the paper, and the page outputs/paper/index.html (SCALE=small: in a minute)
	@$(BIN)/python -m pipelines.paper $(if $(SCALE),scale=$(SCALE))

contest: $(INSTALLED)  ## every agent against every other: outputs/contest/index.html and results.csv (SCALE=small: in minutes)
	@$(BIN)/python -m pipelines.contest $(if $(SCALE),scale=$(SCALE))

$(WARMED): $(INSTALLED) $(shell find fieldrl -name '*.py')
	@$(WARM) > /dev/null
	@touch $@

test: $(INSTALLED) $(WARMED)  ## run all tests
	@$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

check: $(INSTALLED)  ## lint, format, types, floors
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/pyright
	@$(BIN)/lint-imports

docs: $(INSTALLED)  ## the documentation as a site, outputs/docs/index.html
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

ui: $(INSTALLED)  ## open the MLflow UI on the runs of this folder
	@$(BIN)/python -m fieldrl.tracking.ui

clean:  ## remove the virtual environment, caches and everything in outputs/
	@rm -rf .venv .pytest_cache .ruff_cache .hypothesis .import_linter_cache dist build mlruns
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
	@find outputs -mindepth 1 ! -name .gitkeep -delete
