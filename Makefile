# `make help` lists the targets.
PYTHON ?= python3.11
BIN := .venv/bin
INSTALLED := .venv/.installed
# Compiles the inner loops once, before all cores ask for them at the same time.
WARM := $(BIN)/fieldrl episodes=2 steps=3 replicates=1 tracking=none force=true output_dir=.pytest_cache/warm

.DEFAULT_GOAL := help
.PHONY: help setup run paper test check ui clean

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(INSTALLED)  ## create .venv and install fieldrl in it

$(INSTALLED): pyproject.toml constraints.txt
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@echo "Installing fieldrl and its dependencies in .venv (about a minute) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev,paper]'
	@touch $@

run: $(INSTALLED)  ## run the default experiment
	@$(BIN)/fieldrl

paper: $(INSTALLED)  ## every figure and table of the paper, and the page outputs/paper/index.html
	@$(BIN)/python -m pipelines.paper

test: $(INSTALLED)  ## run all tests
	@$(WARM) > /dev/null
	@$(BIN)/python -m pytest -n auto

check: $(INSTALLED)  ## lint, format, types, floors
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/pyright
	@$(BIN)/lint-imports

ui: $(INSTALLED)  ## open the MLflow UI on the runs of this folder
	@$(BIN)/python -m fieldrl.app.ui

clean:  ## remove the virtual environment, caches and everything in outputs/
	@rm -rf .venv .pytest_cache .ruff_cache .hypothesis .import_linter_cache dist build mlruns
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
	@find outputs -mindepth 1 ! -name .gitkeep -delete
