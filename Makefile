# On a new machine, `make report` makes the report and `make test` runs the tests.

PYTHON ?= python3
CORES ?= 2
# One more than the cores, since some slow tests wait for a cluster or an emulated board.
TEST_WORKERS ?= $(shell expr $(CORES) + 1)
ENVIRONMENT := .venv
BIN := $(ENVIRONMENT)/bin

# Snakemake and matplotlib keep caches in the user's home folder. If that folder cannot be written,
# they keep them here instead of stopping with a traceback.
ifneq ($(shell mkdir -p "$${XDG_CACHE_HOME:-$$HOME/.cache}/snakemake" 2>&1),)
export XDG_CACHE_HOME := $(CURDIR)/.snakemake/cache
$(info note: the home folder cannot be written; caches are kept in .snakemake/cache)
endif

.PHONY: help report test test-slow coverage lint docs numbers environment formats

help:  ## list what make can do
	@sed -n 's/^\([a-z-]*\):.*## /make \1  /p' Makefile | awk '{printf "%-18s", $$1 " " $$2; $$1 = $$2 = ""; print}'

report: $(BIN)/capsule  ## set up the environment and make results/report.html
	$(BIN)/snakemake -c$(CORES)

# Where Python may keep nothing, each test worker, command and job would compile its modules anew.
PYTEST := env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest --dist loadfile --no-loadscope-reorder

test: $(ENVIRONMENT)/test-ready  ## set up the environment and run all tests but the slow ones
	$(PYTEST) -n $(CORES) -m "not slow" $(PYTEST_FLAGS)

test-slow: $(ENVIRONMENT)/test-ready  ## run the slow tests; some need programs that .ci/run installs
	$(PYTEST) -n $(TEST_WORKERS) -m slow $(PYTEST_FLAGS)

# The floor is today's share. pyproject.toml says which branches count.
coverage: $(ENVIRONMENT)/test-ready  ## run all tests and measure which branches of the code they run
	$(PYTEST) -n $(TEST_WORKERS) $(PYTEST_FLAGS) --cov --cov-fail-under=89.5

lint: $(ENVIRONMENT)/test-ready  ## check the style of Python and Snakemake files, and the types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint
	$(BIN)/mypy

docs: $(ENVIRONMENT)/test-ready  ## build the manual: build/site/index.html
	$(BIN)/python -m sphinx -W --keep-going -q -d build/manual docs build/site

numbers: report  ## write the report's numbers into README and manual, and draw its picture
	$(BIN)/python workflow/studies/show_numbers.py

environment: $(BIN)/capsule  ## set up the environment in .venv

formats: $(ENVIRONMENT)/formats-ready  ## add Excel, HDF5, NWB, TDMS, XDF, ROS, Parquet, NetCDF, Jupyter

# Python compiles a module when it is first imported, and keeps the result. To compile all modules
# takes as long as to install them. If Python may keep nothing, pip compiles them. The locks name every
# package, so pip need not look for what each one asks for.
INSTALL := pip install --quiet $(if $(PYTHONDONTWRITEBYTECODE),,--no-compile) --no-deps --require-hashes

# The locks pin every package with its hash. If one changes, make sets up the environment again. The
# pip of the first one takes half the time of that of Python 3.11.
$(ENVIRONMENT)/ready: requirements-pip.lock requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || { \
	  echo "error: this is $$($(PYTHON) -V 2>&1), Python 3.11, 3.12 or 3.13 is needed; try: make report PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(ENVIRONMENT)
	$(BIN)/python -m $(INSTALL) --requirement requirements-pip.lock
	$(BIN)/python -m $(INSTALL) --requirement requirements.lock
	@touch $@

# The command `capsule`, and `import capsule`, use the code of this folder. No script of the workflow
# can be imported, and nothing is copied.
$(BIN)/capsule: $(ENVIRONMENT)/ready pyproject.toml
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

# 9 further formats of recordings and results, and the kernel of docs/tutorial.ipynb.
$(ENVIRONMENT)/formats-ready: $(BIN)/capsule requirements-formats.lock
	$(BIN)/python -m $(INSTALL) --requirement requirements-formats.lock
	@touch $@

# The tests and the manual need further packages. All are compiled here, on all cores: in the tests,
# where a warning is an error, a package whose code warns could not be compiled. What they do not import
# themselves, and files that are no Python of this version, stay as they are. pip uses one core, so what
# is there already is compiled meanwhile.
COMPILE := $(BIN)/python -m compileall -qq -x '/(tests?|pip|mypyc?|debugpy|devtools)/' $(ENVIRONMENT)/lib

$(ENVIRONMENT)/test-ready: $(BIN)/capsule requirements-test.lock
	$(COMPILE) & $(BIN)/python -m $(INSTALL) --requirement requirements-test.lock && wait
	-@$(COMPILE) -j $(CORES)
	@touch $@
