# `make` prints what there is to make. A fresh machine needs nothing but `make demo` and `make test`.
#   PYTHON=/path/to/python3   the interpreter for .venv (default: the first of python3, python3.13, ... that is 3.11 or newer)
#   SCAN_DATA=/path           the folder of real images (default: ../shared/data when it exists)
#   PYTEST_FLAGS="-k clock"   passed on to pytest
SHELL := /bin/sh
BIN := .venv/bin
READY := .venv/.ready
PARTS := unit contract system hostile
BENCHES := $(patsubst tests/bench/%.py,%,$(sort $(wildcard tests/bench/bench_*.py)))

ifndef SCAN_DATA
ifneq ($(wildcard ../shared/data/.),)
export SCAN_DATA := $(abspath ../shared/data)
endif
endif

.DEFAULT_GOAL := help
.PHONY: help venv demo docs docs-run figures test test-slow coverage soak attack $(PARTS:%=test-%) test-board deb lint types bench fuzz lock clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

venv: $(READY) ## create or update the virtual environment .venv (the targets below do so by themselves)

$(READY): requirements/dev.txt pyproject.toml common/versions.py
	@.ci/venv

demo: $(READY) ## both programs on this machine, a rendered scene, a full report in out/demo
	@$(BIN)/phone-host demo --out out/demo

test: $(READY) ## unit, contract, system and hostile tests, with the minutes of each part
	@.ci/test $(PARTS)

$(PARTS:%=test-%): test-%: $(READY) # one part alone: make test-unit
	@.ci/test $*

test-slow: $(READY) ## the samples that are too large for every day, of which the unit tests draw small ones
	@$(BIN)/python -m pytest -q -n 2 -m slow tests/unit

coverage: $(READY) ## the unit tests, and which branches of the pure modules none of them takes (CI fails below 98 % of them)
	@COVERAGE=1 .ci/test unit

test-board: $(READY) ## tests on booted virtual boards (the first time builds their images: apt and root)
	@.ci/board
	@.ci/test vm

deb: ## the board's Debian package, into dist
	@deploy/board/build-deb dist

lint: $(READY) ## ruff (rules and format) and the layers of the packages
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet . || { echo "error: not formatted; run: $(BIN)/ruff format ." >&2; exit 1; }
	@$(BIN)/lint-imports --no-logo

types: $(READY) ## mypy --strict
	@$(BIN)/mypy

bench: .venv/.ready-bench ## the figures: every benchmark in tests/bench prints its table; exit 4 when one is missed
	@missed=0; for bench in $(BENCHES); do \
		$(BIN)/python -m tests.bench.$$bench || case $$? in 3) ;; 4) missed=4 ;; *) exit ;; esac; \
	done; exit $$missed # 3: something is missing, and it said what

soak: $(READY) ## ten minutes of a booted board, thirty of both programs (MINUTES=N: each part so long); exit 4 when a limit is missed
	@$(BIN)/python -m tests.bench.soak $(if $(MINUTES),--minutes $(MINUTES))

attack: $(READY) ## every attack on the running programs for ten minutes in all (MINUTES=N, ONLY=word); exit 4 when a limit is missed
	@$(BIN)/python -m tests.system.hostile $(if $(MINUTES),--minutes $(MINUTES)) $(if $(ONLY),--only "$(ONLY)")

figures: .venv/.ready-bench ## short benchmarks of everything, told in docs/figures.md (12 minutes; ONLY=name, AGAIN=1); exit 4 when one is missed
	@$(BIN)/python -m tests.docs.figures $(if $(ONLY),--only "$(ONLY)") $(if $(AGAIN),--again)

.venv/.ready-bench: $(READY) requirements/bench.txt
	@$(BIN)/python -m pip -qq --no-input install --require-hashes --only-binary :all: --no-binary cobs --no-build-isolation -r requirements/bench.txt
	@touch $@

docs: .venv/.ready-docs ## the documentation as a site that opens offline, in build/site
	@$(BIN)/python -m tests.docs.troubleshooting
	@$(BIN)/python -m mkdocs build --strict --config-file tests/docs/mkdocs.yml
	@echo "look at build/site/index.html"

docs-run: $(READY) ## every command line of the documentation that needs no hardware; exit 4 when one fails
	@$(BIN)/python -m tests.docs.run

.venv/.ready-docs: $(READY) requirements/docs.txt
	@$(BIN)/python -m pip -qq --no-input install --require-hashes --only-binary :all: -r requirements/docs.txt
	@touch $@

fuzz: .venv/.ready-fuzz ## hostile bytes for every reader, guided by coverage (BYTES=1e9, MINUTES=10, TARGETS="deframer wire")
	@$(BIN)/python -m tests.fuzz $(if $(BYTES),--bytes $(BYTES)) $(if $(MINUTES),--minutes $(MINUTES)) $(TARGETS)

.venv/.ready-fuzz: $(READY) requirements/fuzz.txt
	@$(BIN)/python -m pip -qq --no-input install --require-hashes --only-binary :all: -r requirements/fuzz.txt
	@touch $@

lock: ## pin again what no longer fits pyproject.toml (UPGRADE=1: everything to its newest)
	@.ci/lock $(if $(UPGRADE),--upgrade)

clean: ## remove results, caches and build leftovers (.venv stays)
	@rm -rf out build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	@find . -path './.venv*' -prune -o -type d -name __pycache__ -prune -exec rm -rf {} +
