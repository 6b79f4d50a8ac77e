# make run: set up, then the main job on the simulated rig; make run RIG=configs/rigs/NAME.yaml: the paper's sweeps on that rig.  make test: set up, then every check that CI runs.
PYTHON ?= python3
# one more than the two processors of CI: the one that reads the clock mostly waits (docs/decisions/0712)
WORKERS ?= 3
BIN := .venv/bin
# without bytecode: what is run is compiled by who runs it first, and what tests import, all of it, by both processors
INSTALL := $(BIN)/python -m pip install -q --disable-pip-version-check --no-compile

export OPENBLAS_NUM_THREADS = 1
# bytecode is kept: otherwise each of the many processes of a run, or of the tests, compiles the sources again
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test lint machine_code bench docs lock clean

run: .venv/run.stamp
	$(if $(RIG),$(BIN)/pamrig run paper --rig $(RIG),$(BIN)/python -m rig.app.tour)

# one processor compiles, which needs nothing that tests only need; the other installs that, and then has the linters;
# whoever is ready first has the bytecode
test: .venv/run.stamp
	$(MAKE) --no-print-directory -j2 machine_code lint .venv/bytecode.stamp
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist worksteal $(if $(SHUFFLE),--shuffle $(SHUFFLE))

lint: .venv/test.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

machine_code: .venv/run.stamp
	$(BIN)/python tests/machine_code.py

docs: .venv/test.stamp
	$(BIN)/mkdocs build -f configs/mkdocs.yml

bench: .venv/test.stamp
	$(BIN)/pamrig bench

.venv/run.stamp: requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(INSTALL) --require-hashes -r requirements.lock
	$(INSTALL) --no-deps --no-build-isolation -e .
	touch $@

.venv/test.stamp: .venv/run.stamp requirements-test.lock
	$(INSTALL) --require-hashes -r requirements-test.lock
	touch $@

# of what was installed, but for others' own tests and the tools that nobody imports here (docs/decisions/0771)
.venv/bytecode.stamp: .venv/test.stamp
	-$(BIN)/python -m compileall -q -j 2 -x '/(tests?|pip|mypyc?|setuptools)/' .venv/lib
	touch $@

lock:
	uv pip compile pyproject.toml --extra web --group build --generate-hashes --no-header --no-emit-index-url --python-version 3.11 -o requirements.lock
	uv pip compile pyproject.toml --all-extras --group build --group test -c requirements.lock --generate-hashes --no-header --no-emit-index-url --python-version 3.11 -o requirements-test.lock

clean:
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
