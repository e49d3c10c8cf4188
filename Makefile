# The verbs of firstlook. Each does all that it needs: packages, build, run.
SHELL := /bin/sh
JOBS ?= $(shell nproc)
export JOBS
ARGS ?=
.DEFAULT_GOAL := build
.PHONY: build run test test-asan format tidy deps clean help

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 20

build: deps ## build/release/firstlook
	@toolchain/build release firstlook

run: build ## the whole job in the simulated cell; ARGS="--cell cluttered --seed 3" goes to `firstlook run`
	@build/release/firstlook run $(ARGS)

test: deps ## every test, by ctest
	@toolchain/build release all
	@ctest --test-dir build/release --output-on-failure -j $(JOBS)

test-asan: deps ## the same under AddressSanitizer and UndefinedBehaviorSanitizer
	@toolchain/build asan-ubsan all
	@ctest --test-dir build/asan-ubsan --output-on-failure -j $(JOBS)

format: ## clang-format everything in place
	@toolchain/install-dependencies check
	@git ls-files '*.cpp' '*.hpp' | xargs clang-format-19 -i

tidy: ## clang-tidy; FILES="a.cpp b.cpp" for some
	@toolchain/install-dependencies check
	@toolchain/tidy $(FILES)

deps: ## install the packages (apt)
	@toolchain/install-dependencies

clean: ## remove what was built
	@rm -rf build
