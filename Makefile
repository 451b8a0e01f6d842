# Every target works from a clean checkout with Python >= 3.11 and a Rust toolchain; what is up to date is not done again.
#   make demo   diagnose the bundled case; the report is femend-demo/report.html
#   make test   Rust tests and the fast Python tests
#   make help   all targets

# A shim may exist for an interpreter that does not run, so candidates are tried and not only looked up.
PYTHON ?= $(shell for p in python3 python3.11 python3.12 python3.13 python3.14 python; do \
	"$$p" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo "$$p" && break; done)
VENV ?= .venv
BIN := $(VENV)/bin
JOBS ?= $(shell nproc 2>/dev/null || sysctl -n hw.ncpu 2>/dev/null || echo 2)
# CARGO_FLAGS=--locked (as .ci/run sets it) refuses a Cargo.lock that does not fit the manifests.
CARGO_FLAGS ?=
PYTEST_FLAGS ?=
# A file's tests stay together, since they share fixtures.
PARALLEL := -n $(JOBS) --dist loadfile
# The extension module leaves libpython's symbols to the interpreter that loads it, so a test executable of that crate
# does not link everywhere. It holds no algorithms; pytest exercises it through the package.
RUST_CRATES := --workspace --exclude femend-py

RUST_SOURCES := $(shell find rust -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock
SMOKE_PYTHON ?= $(PYTHON)
SMOKE_VENV ?= .venv-wheel

export VIRTUAL_ENV := $(abspath $(VENV))
export PYO3_PYTHON := $(abspath $(BIN)/python)

.PHONY: help setup optional pynastran build demo test test-rust test-python proof lint format bench wheel wheel-test lock clean
.DEFAULT_GOAL := help

help:  ## this list
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 22

$(VENV)/.installed: requirements/lock.txt
	@test -n "$(PYTHON)" || { echo "no Python >= 3.11 with venv found; name one: make PYTHON=/path/to/python3" >&2; exit 1; }
	"$(PYTHON)" -m venv $(VENV)
	$(BIN)/python -m pip install --quiet -r requirements/lock.txt
	@touch $@

$(VENV)/.built: $(VENV)/.installed $(RUST_SOURCES) pyproject.toml
	@command -v cargo >/dev/null || { echo "no cargo found; install a Rust toolchain (see rust-version in Cargo.toml)" >&2; exit 1; }
	PIP_QUIET=1 $(BIN)/maturin develop --release --jobs $(JOBS) $(CARGO_FLAGS)
	@touch $@

setup: $(VENV)/.installed  ## the virtual environment with the pinned packages

optional: setup  ## the optional Python packages some tests want: OpenSeesPy, npTDMS
	$(BIN)/python -m pip install --quiet -r requirements/optional.txt

pynastran:  ## the comparator of the deck reader, in an environment of its own
	rm -rf .venv-pynastran
	"$(PYTHON)" -m venv .venv-pynastran
	.venv-pynastran/bin/python -m pip install --quiet -r requirements/pynastran.txt || { rm -rf .venv-pynastran; exit 1; }

build: $(VENV)/.built  ## the extension module in release mode, the package installed in place

demo: build  ## diagnose the bundled case and write femend-demo/
	$(BIN)/femend demo --out femend-demo

test: test-rust test-python  ## Rust tests and the fast Python tests

test-rust: $(VENV)/.installed
	cargo test --release --no-fail-fast --jobs $(JOBS) $(RUST_CRATES) $(CARGO_FLAGS)

test-python: build
	$(BIN)/python -m pytest -m "not slow" -rs --durations=10 $(PARALLEL) $(PYTEST_FLAGS)

proof: build  ## the proofs that take minutes
	cargo test --release --lib --tests --no-fail-fast --jobs $(JOBS) $(RUST_CRATES) $(CARGO_FLAGS) -- --ignored
	$(BIN)/python -m pytest -m slow -rs --durations=0 $(PYTEST_FLAGS)

lint: build  ## formats, lints, types and the stub of the extension module
	cargo fmt --all --check
	cargo clippy --release --workspace --lib --tests --benches --jobs $(JOBS) $(CARGO_FLAGS) -- -D warnings
	$(BIN)/ruff check python tests benches requirements
	$(BIN)/ruff format --check python tests benches requirements
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest femend._core --mypy-config-file pyproject.toml --allowlist tests/api/stubs_allowlist.txt

format: setup  ## apply the formats and the safe lint fixes
	cargo fmt --all
	$(BIN)/ruff check --fix python tests benches requirements
	$(BIN)/ruff format python tests benches requirements

bench: build  ## criterion benches and the whole program on the bundled case
	cargo bench --benches --jobs $(JOBS) $(RUST_CRATES) $(CARGO_FLAGS)
	$(BIN)/python benches/end_to_end.py

wheel: $(VENV)/.installed  ## one wheel for every CPython >= 3.11, in dist/
	rm -rf dist
	$(BIN)/maturin build --release --jobs $(JOBS) $(CARGO_FLAGS) --out dist

wheel-test: wheel  ## the wheel in an environment of its own (SMOKE_PYTHON=python3.13), without whole diagnoses
	rm -rf $(SMOKE_VENV)
	"$(SMOKE_PYTHON)" -m venv $(SMOKE_VENV)
	$(SMOKE_VENV)/bin/python -m pip install --quiet -r requirements/lock.txt dist/femend-*.whl
	$(SMOKE_VENV)/bin/python -m pytest -m "not slow" --without-diagnoses $(PARALLEL) $(PYTEST_FLAGS) $(wildcard tests/api tests/unit)

lock: setup  ## pin anew what pyproject.toml asks for (run it with the oldest Python served)
	$(BIN)/python requirements/lock.py > requirements/lock.new
	mv requirements/lock.new requirements/lock.txt

clean:  ## remove everything that was built or installed
	rm -rf $(VENV) $(SMOKE_VENV) .venv-pynastran target dist femend-demo results .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find python -name '*.so' -delete
	find python tests benches -name __pycache__ -type d -prune -exec rm -rf {} +
