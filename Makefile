# Each target sets up what it needs: a clean clone, Python 3.11 or newer and make are enough.
PYTHON ?= python3
BIN := .venv/bin
SOURCES := $(shell find src -name '*.py')

.PHONY: install demo test check bench validate accuracy gallery

install: .venv/installed .venv/kernels

.venv/installed: pyproject.toml
	test -d .venv || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@

# Numba's cache on disk watches only the file a kernel is written in, not the files it calls into.
.venv/kernels: .venv/installed $(SOURCES)
	find src -name '*.nb[ci]' -delete
	touch $@

demo: install
	$(BIN)/flexband compare examples/slider_crank.py --output output/demo

test: install
	$(BIN)/pytest

check: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright

accuracy: install
	$(BIN)/python benchmarks/accuracy.py

gallery: install
	$(BIN)/python examples/gallery.py

validate: install
	$(BIN)/python validation/table.py

# OPTIONS='--samples 16 --repeats 1' for a quick look
bench: install .venv/benched
	for program in $$(grep -lE "^ +main\(\)" benchmarks/*.py); do \
		$(BIN)/python $$program $(OPTIONS) || exit 1; done

.venv/benched: pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[bench]'
	touch $@
