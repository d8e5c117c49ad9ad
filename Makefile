# Everything runs in .venv, which is made on first use; a second call installs nothing.
#   make test                          make evaluate ARGS="--trials 4"
#   make test PYTHON=python3.12        make test PYTEST_ARGS="-x tests/oracle"

PYTHON ?= python3
# Each process takes a stretch of the tests, then half of what another has left: fixtures of a file are made once.
PYTEST_ARGS ?= -n auto --maxprocesses 8 --dist worksteal
PYTHONS ?= 3.11 3.12 3.13 3.14
ARGS ?=
VENV := .venv
BIN := $(VENV)/bin
# Not compiled: most of what is installed is never imported, and the rest is compiled when it first is.
INSTALL := $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --no-input -c constraints.txt
PINS := pyproject.toml constraints.txt

# One thread for each process: pytest-xdist and the evaluation use the cores by processes.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MPLBACKEND ?= Agg
# Else every process that a test starts compiles the project anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help test tests pythons wheel lint format evaluate reproduce speed docs clean

help:  ## List the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

test: $(VENV)/.dev  ## Every test, and beside them lint, types and floors, which are shown at the end
	@$(MAKE) --no-print-directory lint >$(VENV)/lint.log 2>&1 & lint=$$!; \
	$(BIN)/python -m pytest $(PYTEST_ARGS); tested=$$?; \
	wait $$lint; linted=$$?; cat $(VENV)/lint.log; exit $$((tested ? tested : linted))

tests: $(VENV)/.dev
	$(BIN)/python -m pytest $(PYTEST_ARGS)

pythons:  ## The fast tests on each Python 3.11 to 3.14 that is here, in .venv-3.11 and so on
	@for version in $(PYTHONS); do \
	  command -v python$$version >/dev/null || { echo "python$$version is not here: not tested"; continue; }; \
	  $(MAKE) tests PYTHON=python$$version VENV=.venv-$$version \
	    PYTEST_ARGS="$(PYTEST_ARGS) tests/oracle tests/property" || exit 1; \
	done

wheel:  ## sdist and wheel in dist/, tried from an empty folder
	.ci/wheel $(PYTHON)

lint: $(VENV)/.dev  ## ruff, mypy and the import contracts, without the tests
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy
	@$(BIN)/lint-imports --no-logo

format: $(VENV)/.dev  ## Rewrite the code in the project's layout
	$(BIN)/python -m ruff check --fix .
	$(BIN)/python -m ruff format .

evaluate: $(VENV)/.run  ## Active against random rendezvous, paired; into results/evaluate
	$(BIN)/python -m baselines.evaluate $(ARGS)

reproduce: $(VENV)/.run  ## The paper's figures and claims, 10 worlds each; into results/reproduce
	$(BIN)/python -m baselines.reproduce all --trials 10 --roots 1 $(ARGS)

speed: $(VENV)/.dev  ## Time each part; table and JSON
	$(BIN)/python -m benchmarks.speed $(ARGS)

docs: $(VENV)/.docs  ## The documentation as a site in site/; open site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict $(ARGS)

clean:  ## Remove .venv, caches and build files; results/ stays
	rm -rf $(VENV) .venv-* build dist site *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Stamps: the virtual environment, what running needs, what developing needs on top.
$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "wifipgo needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1)." \
	    "Name another: make PYTHON=python3.12 ..." >&2; exit 1; }
	@echo "Making $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv --clear $(VENV)
	@touch $@

$(VENV)/.run: $(PINS) | $(VENV)/.made
	@echo "Installing wifipgo and what it needs into $(VENV) (about a minute, once)"
	@$(INSTALL) -e '.[video]'
	@touch $@

$(VENV)/.dev: $(PINS) | $(VENV)/.made
	@echo "Installing wifipgo and its development tools into $(VENV) (two minutes, once)"
	@$(INSTALL) -e '.[dev,train]'
	@touch $(VENV)/.run $@

$(VENV)/.docs: $(PINS) | $(VENV)/.made
	@echo "Installing wifipgo and what builds its documentation into $(VENV) (a minute, once)"
	@$(INSTALL) -e '.[docs,video]'
	@touch $(VENV)/.run $@

# All of these at once, for `.ci/run`.
$(VENV)/.all: $(PINS) | $(VENV)/.made
	@echo "Installing wifipgo, its development tools and what builds its documentation into $(VENV) (two minutes, once)"
	@$(INSTALL) -e '.[dev,train,docs]'
	@touch $(VENV)/.run $(VENV)/.dev $(VENV)/.docs $@
