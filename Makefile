# One command per task. On a fresh machine `make demo` and `make test` need only
# git, make, a Rust toolchain and python3.11; everything else goes into VENV.
#
#   make setup   environment with the package built and installed
#   make demo    diagnose a sample case and write a report into demo/
#   make test    Rust tests, stub check, Python tests against the installed wheel: about 20 minutes
#   make test-long   the Python tests that `make test` leaves out: about 15 minutes
#   make lint    formatting, clippy, ruff, spelling, mypy
#   make format  rewrite the sources in the format that lint asks for
#   make docs    regenerate the generated pages and build the site into site/
#   make gallery draw the effects and all plots anew for their pages
#   make notebooks   run the notebooks of the examples and store their outputs
#   make wheel-smoke   the wheel in an empty environment: installed, asked, its demo run, timed
#   make fuzz    readers of every format against 10,000 damaged files each (FUZZ=n for others)
#   make crash   studies and fleets killed 100 times (KILLS=n), damaged, starved and orphaned keep their bits
#   make deny    licences, doubles and sources of the Rust dependencies, by cargo deny where it is
#   make lock    versions of all Python packages of setup and docs, which the gate installs
#   make lowest  the package with the lowest versions of its Python dependencies
#   make bench   criterion benches, then side-by-side runs against other libraries
#   make clean   remove everything that was built

PYTHON ?= python3.11
VENV ?= .venv
CARGO ?= cargo
# Files of Python tests that run beside one another.
JOBS ?= 2
FUZZ ?= 10000
KILLS ?= 100
TARGET := $(or $(CARGO_TARGET_DIR),target)

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
# Byte code is made once, on all processors, when everything is installed.
INSTALL := $(PIP) install --no-compile
WHEELS := $(TARGET)/wheels
STAMPS := $(VENV)/.stamps

# The crates that hold Rust tests; the extension module cannot be linked into a test binary.
RUST_TESTS := --workspace --exclude axisight-python --exclude axisight-benches

# Whatever goes into the wheel. README and licences are part of its metadata.
SOURCES := $(sort $(shell find crates python -type f \
	-not -path '*/__pycache__/*' -not -name '*.so' -not -name '.*') \
	$(wildcard .cargo/config.toml rust-toolchain.toml README.md LICENSE-APACHE LICENSE-MIT) \
	Cargo.toml Cargo.lock pyproject.toml)

# The thesis's study is a package of its own, pure Python.
STUDY := $(sort $(shell find thesis -type f -not -path '*/__pycache__/*' -not -name '.*'))

.PHONY: setup demo test test-rust test-python test-long lint format docs gallery notebooks wheel-smoke fuzz crash deny lock lowest bench clean force
.DELETE_ON_ERROR:

setup: $(STAMPS)/test-tools

demo: $(STAMPS)/installed $(STAMPS)/study
	rm -rf demo
	$(BIN)/axisight demo --out demo
	@report=$$(find demo -name '*.html' | sort | head -n 1); \
	if [ -z "$$report" ]; then echo "demo: no HTML report in demo" >&2; exit 1; fi; \
	echo "Report: $$report"

test: test-rust test-python

test-rust:
	$(CARGO) test --release --locked --no-fail-fast $(RUST_TESTS)

# What the site needs is installed for its tests, which are skipped without. Threads of the linear algebra
# would wait for one another: files run beside one another instead.
test-python: $(STAMPS)/test-tools $(STAMPS)/docs-tools
	$(BIN)/python -m mypy.stubtest axisight._core
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest --numprocesses $(JOBS) --dist loadfile -m "not long" --durations=20

test-long: $(STAMPS)/test-tools $(STAMPS)/docs-tools
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest --numprocesses $(JOBS) --dist loadfile -m long

lint: $(STAMPS)/test-tools
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --workspace --all-targets --locked -- -D warnings
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/codespell README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md docs python thesis crates examples
	$(BIN)/mypy

format: $(STAMPS)/test-tools
	$(CARGO) fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: $(STAMPS)/docs-tools
	$(BIN)/python docs/make_effects.py
	$(BIN)/python docs/make_mujoco_homes.py
	$(BIN)/python docs/make_verdict.py
	$(BIN)/python docs/make_constants.py
	$(BIN)/python docs/make_twenty_robots.py
	$(BIN)/python docs/make_cli.py
	$(BIN)/python docs/make_gallery.py --page-only
	$(BIN)/python docs/make_plots.py --page-only
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

gallery: $(STAMPS)/installed
	$(BIN)/python docs/make_gallery.py
	$(BIN)/python docs/make_plots.py

notebooks: $(STAMPS)/test-tools
	OPENBLAS_NUM_THREADS=1 $(BIN)/python docs/make_notebooks.py

wheel-smoke: $(WHEELS)/.built
	$(PYTHON) tests/wheel_smoke.py $(WHEELS)

fuzz: $(STAMPS)/test-tools
	AXISIGHT_FUZZ=$(FUZZ) $(CARGO) test --release --locked -p axisight-tests --test damaged_robots
	AXISIGHT_FUZZ=$(FUZZ) $(BIN)/python -m pytest -q tests/python/fuzz/test_fuzz_readers.py tests/python/fuzz/test_fuzz_documents.py

crash: $(STAMPS)/test-tools
	$(BIN)/python tests/python/crash_trial.py $(KILLS)

lock: $(STAMPS)/test-tools $(STAMPS)/docs-tools
	{ echo "# Written by make lock: what the gate installs of Python packages."; \
	$(BIN)/python -m pip freeze --exclude axisight --exclude axisight-thesis; } > .ci/constraints.txt

# Lowest versions of what pyproject.toml asks for, in an environment of their own.
LOWEST := $(VENV)/lowest
LOWEST_TESTS := cli/test_cli logs/test_logs_reading logs/test_logs_errors montecarlo/test_montecarlo_store \
	storage/test_store_foreign excitation/test_excitation_limits report/test_report storage/test_damaged_results
lowest: $(STAMPS)/installed
	$(INSTALL) 'uv>=0.4'
	rm -rf $(LOWEST)
	$(BIN)/uv venv --quiet --python $(BIN)/python $(LOWEST)
	$(BIN)/uv pip compile --quiet --resolution lowest-direct pyproject.toml --output-file $(LOWEST)/lowest.txt
	$(BIN)/uv pip install --quiet --python $(LOWEST)/bin/python --only-binary :all: \
		--requirement $(LOWEST)/lowest.txt 'pytest>=8' 'hypothesis>=6'
	$(BIN)/uv pip install --quiet --python $(LOWEST)/bin/python --no-deps $(WHEELS)/axisight-*.whl
	$(LOWEST)/bin/axisight demo --out $(LOWEST)/demo
	$(LOWEST)/bin/python -m pytest -q $(patsubst %,tests/python/%.py,$(LOWEST_TESTS))

# Tests hold licences, doubles and sources against deny.toml too, without cargo deny.
deny:
	@$(CARGO) deny --version || { echo "deny: cargo install cargo-deny --locked" >&2; exit 1; }
	$(CARGO) deny --locked --offline check licenses bans sources
	@if $(CARGO) deny --locked fetch db 2>/dev/null; then $(CARGO) deny --locked check advisories; \
	else echo "deny: the database of advisories is out of reach: advisories not checked"; fi

bench: $(STAMPS)/bench-tools
	$(CARGO) bench --locked -p axisight-benches
	@for script in $(wildcard benches/peers/*.py); do \
		echo "$$script"; $(BIN)/python $$script || exit 1; \
	done

clean:
	$(CARGO) clean
	rm -rf $(VENV) $(WHEELS) demo site .mypy_cache .pytest_cache .ruff_cache .hypothesis

# --- set-up, each step done once -------------------------------------------------------

$(STAMPS)/venv:
	@command -v $(PYTHON) >/dev/null || { echo "$(PYTHON) not found: install it or set PYTHON=" >&2; exit 1; }
	@command -v $(CARGO) >/dev/null || { echo "$(CARGO) not found: install a Rust toolchain (https://rustup.rs)" >&2; exit 1; }
	$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv $(VENV)
	mkdir -p $(STAMPS)
	touch $@

$(STAMPS)/build-tools: $(STAMPS)/venv
	$(INSTALL) 'maturin>=1.9,<2' 'flit_core>=3.11,<4'
	touch $@

# Written anew only when a file was added or removed, so that the wheel notices that too.
$(WHEELS)/.sources: force
	@mkdir -p $(WHEELS)
	@printf '%s\n' $(SOURCES) | cmp -s - $@ || printf '%s\n' $(SOURCES) > $@

# Dated from the start of the build: a source edited meanwhile counts as newer. What the wheel
# depends on is fetched while the compiler works.
$(WHEELS)/.built: $(WHEELS)/.sources $(SOURCES) | $(STAMPS)/build-tools
	@rm -f $(WHEELS)/axisight-*.whl
	@touch $@.begun
	@$(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["dependencies"], sep="\n")' > $@.requirements
	$(INSTALL) --requirement $@.requirements & fetched=$$!; \
	$(BIN)/maturin build --release --locked --interpreter $(BIN)/python --out $(WHEELS); \
	built=$$?; wait $$fetched && exit $$built
	@mv $@.begun $@

# An editable install (`maturin develop`) is replaced: tests and demo use the wheel.
ifneq ($(wildcard $(VENV)/lib/python*/site-packages/axisight.pth),)
$(STAMPS)/installed: force
endif
$(STAMPS)/installed: $(WHEELS)/.built
	$(INSTALL) $(WHEELS)/axisight-*.whl
	$(INSTALL) --force-reinstall --no-deps $(WHEELS)/axisight-*.whl
	touch $@

# Needs nothing that the wheel does not bring.
$(STAMPS)/study: $(STUDY) | $(STAMPS)/installed
	$(INSTALL) --force-reinstall --no-deps --no-build-isolation ./thesis
	touch $@

# The dependencies of an extra change only with pyproject.toml.
# Commands that tests start import byte code, also where Python is told to write none; files of other
# packages that are no Python are no fault here.
$(STAMPS)/test-tools: $(STAMPS)/test-extra $(STAMPS)/test-arms $(STAMPS)/installed $(STAMPS)/study
	-$(BIN)/python -m compileall -q -j 0 $(VENV)/lib
	touch $@

# MJCF files of arms that tests import; the package itself and what it needs are not used.
$(STAMPS)/test-arms: | $(STAMPS)/installed
	$(INSTALL) --no-deps robosuite==1.5.2
	touch $@

$(STAMPS)/docs-tools: $(STAMPS)/docs-extra $(STAMPS)/installed
	touch $@

$(STAMPS)/bench-tools: $(STAMPS)/bench-extra $(STAMPS)/installed
	touch $@

$(STAMPS)/%-extra: pyproject.toml | $(STAMPS)/installed
	$(INSTALL) "$$(ls $(WHEELS)/axisight-*.whl)[$*]"
	touch $@
