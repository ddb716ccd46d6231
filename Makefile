# The commands of the project. Everything they need beyond Rust and Python >= 3.11 goes into .venv.

# The first Python on the path that is new enough; `make PYTHON=... demo` takes another.
PYTHON ?= $(shell for python in python3 python3.14 python3.13 python3.12 python3.11 python; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$python; break; }; done)

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

# What the installed package is built from; Python files are used in place.
SOURCES := Cargo.toml Cargo.lock pyproject.toml $(shell find src -name '*.rs')

# Examples of `make fuzz`.
EXAMPLES ?= 10000

.PHONY: help demo fuzz coverage coverage-rust test test-rust test-rust-doc test-python test-python-doc test-slow test-wheel figure wheel studies validation bench clean
.PHONY: lint lint-rust lint-python fmt clippy rustdoc ruff ruff-format mypy stubtest

help:
	@echo 'make demo        build, run the robot for 100 s of its time, leave robot.h5 and robot.png'
	@echo 'make test        build, run the tests: Rust, Python, and the examples of the documents'
	@echo 'make test-slow   those Python tests that take more than half a minute each'
	@echo 'make lint        formatting, lints and types of both languages'
	@echo 'make fuzz        random scenes that no test has seen; EXAMPLES=100000 for as many, an hour or more'
	@echo 'make coverage    lines of the Python package that its tests run; make coverage-rust those of the core'
	@echo 'make figure      the picture of the robot in the README'
	@echo 'make studies     the studies of Lim et al.: speed against rpm for meshes and geometries'
	@echo 'make validation  every number and figure of docs/validation'
	@echo 'make bench       every number of docs/performance.md'
	@echo 'make wheel       the wheel, in dist/; make test-wheel tries it in an empty environment'
	@echo 'make clean       remove what these commands have built'

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo 'error: no Python >= 3.11 on the path' >&2; exit 1; }
	@cargo --version >/dev/null || { echo 'error: no Rust toolchain on the path; see https://rustup.rs' >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

# The package to use, with figures.
$(VENV)/installed: $(SOURCES) | $(BIN)/python
	@echo 'building flagrs into $(VENV): some minutes the first time'
	$(PIP) install --editable '.[plot]'
	@touch $@

# The package to work on, with everything tests and checks need.
$(VENV)/equipped: $(SOURCES) | $(BIN)/python
	@echo 'building flagrs with its tools into $(VENV): some minutes the first time'
	$(PIP) install --editable '.[dev]'
	@touch $@ $(VENV)/installed

demo: $(VENV)/installed
	$(BIN)/flagrs run robot --until 100 --output robot.h5 --figure robot.png --fresh

test: test-rust test-rust-doc test-python test-python-doc

test-rust:
	@if cargo nextest --version >/dev/null 2>&1; then \
		set -x; cargo nextest run --locked --no-fail-fast; \
	else \
		set -x; cargo test --locked --no-fail-fast --lib --tests; \
	fi

test-rust-doc:
	cargo test --locked --doc

test-python: $(VENV)/equipped
	$(BIN)/python -m pytest -m 'not slow' tests/python

test-slow: $(VENV)/equipped
	$(BIN)/python -m pytest -m slow tests/python

# New scenes every time, against the properties of tests/python/test_fuzz.py; a failing one is printed as TOML.
fuzz: $(VENV)/equipped
	FLAGRS_FUZZ_EXAMPLES=$(EXAMPLES) $(BIN)/python -m pytest tests/python/test_fuzz.py

# Lines of the package and of the core that their tests run; CONTRIBUTING says what the second needs.
coverage: $(VENV)/equipped
	$(BIN)/python -m coverage run --source=python/flagrs -m pytest -m 'not slow' tests/python
	$(BIN)/python -m coverage report --skip-covered

coverage-rust:
	cargo llvm-cov --locked --lib --tests --summary-only

test-python-doc: $(VENV)/equipped
	$(BIN)/python -m pytest --doctest-modules python/flagrs

lint: lint-rust lint-python

lint-rust: fmt clippy rustdoc
lint-python: ruff ruff-format mypy stubtest

fmt:
	cargo fmt --check

clippy:
	cargo clippy --locked --all-targets --features python -- -D warnings

rustdoc:
	RUSTDOCFLAGS='-D warnings' cargo doc --locked --no-deps

ruff: $(VENV)/equipped
	$(BIN)/ruff check

ruff-format: $(VENV)/equipped
	$(BIN)/ruff format --check

mypy: $(VENV)/equipped
	$(BIN)/mypy

stubtest: $(VENV)/equipped
	$(BIN)/stubtest flagrs._flagrs

figure: $(VENV)/installed
	$(BIN)/python docs/images/make_robot_figure.py

studies: $(VENV)/installed
	$(BIN)/flagrs study convergence
	$(BIN)/flagrs study geometries

validation: $(VENV)/equipped
	set -e; for script in docs/validation/make_*.py; do $(BIN)/python $$script; done
	$(BIN)/flagrs validate --full --report docs/validation/report

bench: $(VENV)/equipped
	cargo bench --locked
	set -e; for script in cargo_results kernels steps speed_against_error far_field bundles contact_methods rollouts; do \
		$(BIN)/python benches/python/$$script.py --document docs/performance.md; \
	done

wheel: | $(BIN)/python
	rm -rf dist
	$(PIP) wheel --no-deps --wheel-dir dist .

# In an empty environment, and away from the sources.
test-wheel: wheel
	$(PYTHON) -m venv dist/trial
	dist/trial/bin/python -m pip --disable-pip-version-check --quiet install dist/*abi3*.whl
	cd / && '$(CURDIR)'/dist/trial/bin/flagrs doctor

clean:
	cargo clean
	rm -rf $(VENV) dist python/flagrs/_flagrs*.so
