# Each target sets up what it needs: a clean clone, Python 3.11 or newer and make are enough.
PYTHON ?= python3
BIN := .venv/bin
JOBS ?= 1
# Hundreds of processes import the same modules, so bytecode is kept even where that is turned off.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: install demo compare test kernels check metrics unchanged wheel bench validate accuracy honesty numerics paper gallery report-picture inputs models references docs

install: .venv/installed

.venv/installed: pyproject.toml
	test -d .venv || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile --editable '.[dev]'
	touch $@

demo: install
	$(BIN)/flexband run examples/slider_crank.py --output output/demo

# The methods on the paper's coarse model, against LHS–Scanning of the same model.
compare: install
	$(BIN)/flexband compare examples/paper/slider_crank.py --output output/compare

# One thread of OpenBLAS in each of pytest's processes, of which there is one more than cores.
test kernels: export OPENBLAS_NUM_THREADS = 1

test: install
	$(BIN)/python -m tests.compiled
	$(BIN)/pytest

# The methods under another kernel of OpenBLAS, whose sums are rounded otherwise.
KERNEL_TESTS := adaptive/test_adaptive.py adaptive/test_correction.py phase_resolved surrogates/test_constants.py \
	runs/test_repetition.py
kernels: install
	OPENBLAS_CORETYPE="$$($(BIN)/python -m tests.kernels)" \
		$(BIN)/pytest --dist load $(KERNEL_TESTS:%=tests/uncertainty/%)

check: install metrics
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright

# How readable the package is. OPTIONS=--record lowers the ceilings to today's values.
metrics: install
	$(BIN)/python .ci/metrics.py $(OPTIONS)

# OPTIONS='--against REV' names the commit with which the working tree is compared.
unchanged: install
	$(BIN)/python .ci/unchanged.py $(OPTIONS)

# On every Python of this machine, on the oldest with the lowest versions of pyproject.toml.
# WHEEL=--check takes the oldest and the newest, and writes nothing.
wheel: install
	$(BIN)/python .ci/wheel.py $(WHEEL)

accuracy: install
	$(BIN)/python -m benchmarks.accuracy.accuracy

# With the seeds of the documentation, which no method may be tuned to.
honesty: install
	$(BIN)/python -m benchmarks.honesty.honesty --seed 9744000 --samples 608 --jobs $(JOBS) $(OPTIONS)

numerics: install
	$(BIN)/python -m benchmarks.numerics.numerics
	$(BIN)/python -m benchmarks.numerics.discretization --seed 1000000

# OPTIONS='--page again' to write the page from the stored numbers alone.
paper: install
	$(BIN)/python -m benchmarks.paper.paper $(OPTIONS)

gallery: install
	$(BIN)/python examples/gallery.py
	$(BIN)/python -m benchmarks.pictures.readme

report-picture: install
	$(BIN)/python -m benchmarks.pictures.report

inputs: install
	$(BIN)/python -m benchmarks.pictures.inputs

validate: install
	$(BIN)/python validation/table.py
	$(BIN)/python validation/exudyn/page.py

# The tests of other people's models, with FMPy, Exudyn, pylinkage and UM-Bridge.
models: install .venv/modelled
	$(BIN)/pytest tests/models

.venv/modelled: pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile --editable '.[fmi,umbridge,bench]'
	touch $@

references: install .venv/referenced
	$(BIN)/pytest tests/uncertainty/expansions/test_references.py

.venv/referenced: pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile --editable '.[reference]'
	touch $@

# The site, in output/docs/index.html: every tutorial is executed, every warning is an error.
docs: install .venv/documented
	PATH="$(CURDIR)/$(BIN):$$PATH" sphinx-build -E -W --keep-going -n -q docs output/docs

.venv/documented: pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile --editable '.[docs]'
	touch $@

# OPTIONS='--samples 16 --repeats 1' JOBS=2 for a quick look
bench: install .venv/benched
	grep -lrE "^ +main\(\)" benchmarks --include='*.py' | sed 's#/#.#g; s#[.]py$$##' \
		| xargs -I {} -P $(JOBS) $(BIN)/python -m {} $(OPTIONS)

.venv/benched: pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile --editable '.[bench]'
	touch $@
