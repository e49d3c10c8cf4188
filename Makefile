# The verbs of firstlook. Each does all that it needs: packages, build, run.
SHELL := /bin/sh
export JOBS
ARGS ?=
ONLY ?=
.DEFAULT_GOAL := build
.PHONY: build run test test-asan bench deb rig rig-short rig-power format tidy deps clean help

help: ## this list
	@echo 'make                   build/release/firstlook'
	@sed -n 's/^\([a-z-]*\):.*## /make \1\t/p' Makefile | expand -t 23
	@echo 'JOBS=N                 compilers and tests at once; default: one a core, fewer on a machine with little memory'

build: deps
	@toolchain/build release firstlook

run: build ## the whole job in the simulated cell; ARGS="--cell cluttered --seed 3" goes to `firstlook run`
	@build/release/firstlook run $(ARGS)

test: deps ## every test, by ctest; ARGS="-R mapping" goes to ctest
	@toolchain/build release all
	@ctest --test-dir build/release --output-on-failure --progress -j "$$(toolchain/jobs)" $(ARGS)

test-asan: deps ## the same under AddressSanitizer and UndefinedBehaviorSanitizer
	@toolchain/build asan-ubsan all
	@ctest --test-dir build/asan-ubsan --output-on-failure --progress -j "$$(toolchain/jobs)" $(ARGS)

bench: ## figures against their peers, into build/bench.json; ONLY=calibration|intrinsics|bundle|view_design|detection|map|gain|motion|views|loop
	@toolchain/install-dependencies bench
	@toolchain/build release firstlook_bench
	@build/release/tests/bench/firstlook_bench --json build/bench.json $(if $(ONLY),--only $(ONLY)) $(ARGS)

format: ## clang-format everything in place
	@toolchain/install-dependencies check
	@toolchain/format

deb: deps ## build/firstlook_VERSION_ARCH.deb: program, service, rules for cameras and CAN
	@toolchain/build release firstlook packaging_texts
	@toolchain/package

rig-short: rig-parts ## boots the package in an emulated computer: to Ready, a button, motion, a power cut; KIND=std|rt
	@tests/rig/rig short $(or $(KIND),std)

rig: rig-parts ## the same on both kernels, and everything that breaks (root)
	@tests/rig/rig full

rig-power: rig-parts ## power cuts at seeded moments; CUTS=50 SEED=1
	@tests/rig/rig power $(or $(CUTS),50) $(or $(SEED),1)

image: ## build/firstlook_VERSION_KIND.img, a disk that an industrial PC boots (root); KIND=std|rt
	@toolchain/install-dependencies rig
	@$(MAKE) --no-print-directory deb
	@toolchain/image $(or $(KIND),std)

.PHONY: rig-parts image
rig-parts:
	@toolchain/install-dependencies rig
	@toolchain/build release firstlook packaging_texts rig_programs
	@toolchain/package

tidy: ## clang-tidy; FILES="a.cpp b.cpp" for some
	@toolchain/install-dependencies check
	@toolchain/tidy $(FILES)

deps: ## install the packages (apt)
	@toolchain/install-dependencies

clean: ## remove what was built
	@rm -rf build
