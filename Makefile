# Each target works from a fresh clone: it creates .venv, installs what it needs, and runs.
# Windows: the same steps with pip are in docs/install.md.

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python3.14; do \
	if command -v $$p >/dev/null 2>&1 && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))'; \
	then echo $$p; exit; fi; done)
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-input

INSTALLED := $(VENV)/.installed
SIDE_BY_SIDE = $(BIN)/python -m pytest --numprocesses auto --maxprocesses 8 --dist worksteal

DOCS_INSTALLED := $(VENV)/.installed-docs

.PHONY: help demo test test-all test-arithmetic lint bench docs clean

help:
	@echo 'make demo   recover three matrices and draw the meshes (into demo-output/)'
	@echo 'make test   run the tests, also with the fallback solver'
	@echo 'make test-all  the same, and the long families'
	@echo 'make test-arithmetic  the tests that decide close to the last digits, with other kernels, threads and solvers'
	@echo 'make lint   check style, types, and which rooms use which'
	@echo 'make bench  run the benchmarks'
	@echo 'make docs   build the documentation (into docs/_build/html/)'
	@echo 'make clean  remove everything that the other targets made'

$(BIN)/python:
	@test -n '$(PYTHON)' || { echo 'Python 3.11 or newer is needed; name it with make PYTHON=...' >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

# The fast extra may need a C compiler (planarity) or have no wheels (MKL): install what there is of it.
$(INSTALLED): pyproject.toml | $(BIN)/python
	@echo 'Installing into $(VENV) (once)'
	@for fast in fast pardiso none; do \
		extras=demo,test,lint,bench; \
		if [ $$fast != none ]; then extras=$$fast,$$extras; fi; \
		if $(PIP) -e ".[$$extras]"; then \
			if [ $$fast != fast ]; then echo "Note: the extra [fast] could not be installed whole; installed: [$$extras]"; fi; \
			touch $@; exit 0; \
		fi; \
	done; exit 1

$(DOCS_INSTALLED): $(INSTALLED)
	$(PIP) -e '.[docs]'
	@touch $@

demo: $(INSTALLED)
	$(BIN)/unassemble demo

# The short first pass repeats what depends on the sparse solver with the one that every machine has. The tests run side
# by side on all cores, each process with one thread: threads of several processes would wait for each other.
test test-all: export OMP_NUM_THREADS := 1
test: $(INSTALLED)
	UNASSEMBLE_SOLVER=superlu $(BIN)/python -m pytest -q -m 'fallback and not slow'
	$(SIDE_BY_SIDE) -m 'not slow'

test-all: test
	$(SIDE_BY_SIDE) -m slow

# What this processor cannot run, or computes as another does, is left out, and said.
test-arithmetic: $(INSTALLED)
	$(BIN)/python benchmarks/arithmetic.py -- -m 'arithmetic and not slow' \
		--numprocesses auto --maxprocesses 8 --dist worksteal tests

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache --no-logo

# For instance: make bench BENCH='--sizes 10000,100000'
bench: $(INSTALLED)
	$(BIN)/python benchmarks/planar.py $(BENCH)
	$(BIN)/python benchmarks/elements.py $(BENCH)

docs: $(DOCS_INSTALLED)
	$(BIN)/sphinx-build --fail-on-warning --keep-going -b html docs docs/_build/html

clean:
	rm -rf $(VENV) build dist docs/_build demo-output .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
