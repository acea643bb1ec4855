# `make` lists the targets. On a fresh machine, `make demo` and `make test` need no preparation. `make demo` installs what the commands need
# at run time; the targets for development add their tools to the same .venv.
#   PYTHON=/path/to/python3   the interpreter for .venv (default: the first of python3, python3.13, ... that is version 3.11 or newer)
#   SCAN_DATA=/path           the folder of real images (default: ../shared/data if it exists)
#   PYTEST_FLAGS="-k clock"   passed on to pytest
SHELL := /bin/sh
BIN := .venv/bin
READY := .venv/.ready
RUN := .venv/.ready-run
PARTS := unit cases scan contract native system hostile print web
# Every signal in every state, and printers that lie: `make test` runs a part of them, `make attack` all.
SIGNALS := tests/print/test_signals.py tests/print/test_lying_printers.py tests/print/test_strange_firmware.py tests/system/test_signals_of_verbs.py
# What the native library is made of; .ci/venv knows the same.
NATIVE := setup.py phone_host/native/build_library.py $(wildcard phone_host/native/src/*)
# What is right or wrong without a rendered image, a process or a camera: protocol, clocks and pairing, queues, the stereo core's geometry, formats.
CORE := $(patsubst %,tests/unit/%,common/protocol sync stream common/imagesize) $(patsubst %,tests/unit/common/test_%.py,frame ledger stamp) \
	$(patsubst %,tests/unit/common/recording/test_%.py,cdr image_layouts recording_bytes) \
	$(patsubst %,tests/unit/stereo/test_%.py,depth_limits filters raw_images rectify reproject) \
	$(patsubst %,tests/unit/output/test_%.py,json_text pfm ply rig_yaml yaml_text)
BENCHES := $(patsubst tests/bench/%.py,%,$(sort $(wildcard tests/bench/bench_*.py)))

ifndef SCAN_DATA
ifneq ($(wildcard ../shared/data/.),)
export SCAN_DATA := $(abspath ../shared/data)
endif
endif

.DEFAULT_GOAL := help
.PHONY: help run-venv venv demo native vendor vendor-check docs docs-run figures test test-slow test-fresh coverage soak attack $(PARTS:%=test-%) test-core test-arm test-board walk deb lint types bench fuzz oracles printers lock clean

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

run-venv: $(RUN) ## create .venv with what the commands need at run time (make demo does this itself)

$(RUN): requirements/run.txt pyproject.toml common/versions.py $(NATIVE)
	@.ci/venv run

venv: $(READY) ## create or update .venv with the development tools, too (the other targets do this themselves)

$(READY): requirements/dev.txt pyproject.toml common/versions.py $(NATIVE)
	@.ci/venv dev

demo: $(RUN) ## run both programs on this machine with a rendered scene; writes a full report to out/demo
	@$(BIN)/phone-host demo --out out/demo

native: $(RUN) ## build the native library again, in place (the set-up does this itself; after installing a compiler, or with CC=clang)
	@$(BIN)/python -m phone_host.native.build_library

test: $(READY) ## run the unit, cases, scan, contract, native, system, hostile, print and web tests; prints the minutes of each part
	@.ci/test $(PARTS)

$(PARTS:%=test-%): test-%: $(READY) # run one part: make test-unit
	@.ci/test $*

test-core: $(READY) ## run the tests of protocol, clocks, pairing, queues, stereo geometry and formats: ten seconds, for every day (PYTEST_FLAGS="-k clock")
	@$(BIN)/python -m pytest -q -m "not slow and not long and not many" $(PYTEST_FLAGS) $(CORE)

test-slow: $(READY) ## run the tests with large samples, too slow for every day, and the properties with new random examples; the other tests use small, equal ones
	@$(BIN)/python -m pytest -q -n 2 -m "slow or hypothesis" --hypothesis-profile=exploring tests/unit tests/scan tests/contract tests/print

test-fresh: ## run `make test` in a root made by debootstrap that holds git, make, gcc and python3-venv, quiet and beside busy loops (root; BUSY=0 or 1: one of them, TARGETS="test-unit", REBUILD=1)
	@.ci/fresh

coverage: $(READY) ## run the unit, cases, scan, contract and print tests; lists branches of the pure modules that no test takes (CI requires 98 %)
	@COVERAGE=1 .ci/test unit cases scan contract print

test-arm: $(READY) ## compare the native library's bits on aarch64, armv7 and older x86 with this machine's, and try the phone's stand-in, under qemu-user
	@$(BIN)/python -m tests.native.arm
	@.ci/phone
	@.ci/test phone

test-board: $(READY) ## run the tests on booted virtual boards (the first run builds their images: needs apt and root)
	@.ci/board
	@.ci/test vm

walk: $(READY) ## walk the ways between board and phone on the booted virtual board, as docs/phone.md says (two minutes)
	@.ci/board
	@WALK=1 $(BIN)/python -m pytest -q tests/vm/test_gadget.py -k each_way

deb: ## build the board's Debian package in dist
	@deploy/board/build-deb dist

lint: $(READY) ## check with ruff (rules and format) and check the layers of the packages
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet . || { echo "error: not formatted; run: $(BIN)/ruff format ." >&2; exit 1; }
	@$(BIN)/lint-imports --no-logo

types: $(READY) ## check with mypy --strict
	@$(BIN)/mypy

bench: .venv/.ready-bench ## run every benchmark in tests/bench; each prints its table; exit 4 if a figure is missed
	@missed=0; for bench in $(BENCHES); do \
		$(BIN)/python -m tests.bench.$$bench || case $$? in 3) ;; 4) missed=4 ;; *) exit ;; esac; \
	done; exit $$missed # 3: something it needs is missing; the benchmark has said what

soak: $(READY) ## run a booted board for ten minutes and both programs for thirty (MINUTES=N for each part); exit 4 if a limit is missed
	@$(BIN)/python -m tests.bench.soak $(if $(MINUTES),--minutes $(MINUTES))

attack: $(READY) ## run every attack on the running programs, ten minutes in all (MINUTES=N, ONLY=word), then every signal in every state of a print by every door, and printers that lie (five minutes; not with ONLY); exit 4 if a limit is missed
	@missed=0; $(BIN)/python -m tests.system.hostile $(if $(MINUTES),--minutes $(MINUTES)) $(if $(ONLY),--only "$(ONLY)") || missed=$$?; \
	$(if $(ONLY),:) $(BIN)/python -m pytest -q -n 4 -m "slow or not slow" $(SIGNALS) || missed=4; exit $$missed

figures: .venv/.ready-bench ## run short benchmarks of everything and write docs/figures.md (an hour; ONLY=name, AGAIN=1); exit 4 if one is missed
	@$(BIN)/python -m tests.docs.figures $(if $(ONLY),--only "$(ONLY)") $(if $(AGAIN),--again)

.venv/.ready-bench: $(READY) requirements/bench.txt
	@$(BIN)/python -m pip -qq --no-input install --require-hashes --only-binary :all: --no-binary cobs --no-build-isolation -r requirements/bench.txt
	@touch $@

docs: .venv/.ready-docs ## build the documentation as a site that opens offline, in build/site
	@$(BIN)/python -m mkdocs build --strict --config-file tests/docs/mkdocs.yml
	@echo "look at build/site/index.html"

docs-run: $(READY) ## run every command line of the documentation that needs no hardware; exit 4 if one fails
	@$(BIN)/python -m tests.docs.run

.venv/.ready-docs: $(READY) requirements/docs.txt
	@$(BIN)/python -m pip -qq --no-input install --require-hashes --only-binary :all: -r requirements/docs.txt
	@touch $@

fuzz: .venv/.ready-fuzz ## feed pairs to the native matcher, requests to the page, and hostile bytes to every reader, guided by coverage (BYTES=1e9, MINUTES=10, TARGETS="match page wire")
	@$(if $(TARGETS),$(if $(filter match,$(TARGETS)),,:)) $(BIN)/python -m tests.native.fuzz_match $(if $(MINUTES),--minutes $(MINUTES))
	@$(if $(TARGETS),$(if $(filter page,$(TARGETS)),,:)) env EXAMPLES=500 $(BIN)/python -m pytest -q -o timeout=1800 --hypothesis-profile=exploring tests/web/test_api_description.py
	@$(if $(TARGETS),$(if $(filter-out match page,$(TARGETS)),,:)) $(BIN)/python -m tests.fuzz $(if $(BYTES),--bytes $(BYTES)) $(if $(MINUTES),--minutes $(MINUTES)) $(filter-out match page,$(TARGETS))

.venv/.ready-fuzz: $(READY) requirements/fuzz.txt
	@$(BIN)/python -m pip -qq --no-input install --require-hashes --only-binary :all: -r requirements/fuzz.txt
	@touch $@

oracles: $(READY) ## install what judges recordings, other programs' readers of MCAP, into build/oracles (850 MB, of which Rerun 750)
	@$(BIN)/python -m venv build/oracles
	@build/oracles/bin/python -m pip -qq --no-input install "mcap-ros2-support>=0.5" "rosbags>=0.10" "rerun-sdk>=0.41"
	@build/oracles/bin/rerun analytics disable

printers: ## install what judges prints, other programs' servers and senders, into build/printers (750 MB)
	@for name in octoprint moonraker printrun meshes; do $(BIN)/python -m venv build/printers/$$name || exit; done
	@build/printers/octoprint/bin/python -m pip -qq --no-input install "OctoPrint>=1.11.8,<1.12"
	@build/printers/moonraker/bin/python -m pip -qq --no-input install "moonraker>=0.11"
	@build/printers/printrun/bin/python -m pip -qq --no-input install --no-deps "Printrun>=2.2" pyserial
	@build/printers/meshes/bin/python -m pip -qq --no-input install pymeshlab trimesh manifold3d lib3mf lxml networkx
	@cd build/printers && if apt-get -qq download cura 2>/dev/null; then dpkg -x cura_*.deb cura && rm cura_*.deb; fi # its definitions, for cura-engine

vendor: ## build the page's libraries and the static pages' scripts again, from npm's tarballs (after changing phone_host/web/page; needs node; PIN=1: note the tarballs of other versions)
	@$(if $(PIN),node .ci/vendor.mjs pin &&) node .ci/vendor.mjs build

vendor-check: ## build them elsewhere and compare: they are what npm's tarballs and our modules give
	@node .ci/vendor.mjs check

lock: ## update pins that no longer fit pyproject.toml (UPGRADE=1: pin the newest of everything)
	@.ci/lock $(if $(UPGRADE),--upgrade)

clean: ## remove results, caches and build files; keeps .venv
	@rm -rf out build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	@find . -path './.venv*' -prune -o -type d -name __pycache__ -prune -exec rm -rf {} +
