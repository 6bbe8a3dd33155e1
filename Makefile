# hsbench: `make demo` shows the product, `make test` passes the tests; both set up .venv on demand.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
JOBS   ?= 2

.PHONY: setup demo test test-slow lint docs bench clean help
.DEFAULT_GOAL := help

help: ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 10

setup: $(STAMP) ## make .venv with hsbench and what its tests need

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "$(PYTHON) is older than 3.11; name a newer one: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "$(PYTHON) cannot make virtual environments; on Debian: apt-get install python3-venv" >&2; exit 2; }
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: $(STAMP) ## generate rooms, run baselines, score, and write demo/report.html (a few minutes)
	$(BIN)/hsbench demo --out demo

test: $(STAMP) ## run the test suite (minutes)
	$(BIN)/python -m pytest -n $(JOBS) -m "not slow"

test-slow: $(STAMP) ## run the slow tests besides, and check 100 generated scenes
	$(BIN)/python -m pytest -n $(JOBS) -m slow
	$(BIN)/hsbench verify --scenes 100 --workers $(JOBS)

lint: $(STAMP) ## ruff and mypy --strict
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(STAMP) ## build the documentation, strictly, into docs/_build/html
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	@echo docs/_build/html/index.html

bench: $(STAMP) ## run the benchmarks and print their ratios
	$(BIN)/python -m pytest tests/benchmarks --benchmark-enable --benchmark-only -s

clean: ## remove what the targets made
	rm -rf $(VENV) demo docs/_build .mypy_cache .ruff_cache
