# omentum: the commands a person types. `make help` lists them.
# Everything is built under build/, nothing outside the checkout is written except by setup and install.
SHELL := /bin/bash
PREFIX ?= /usr/local
DESTDIR ?=
JOBS ?= $(shell nproc)
FUZZ_SECONDS ?= 300

RELEASE := build/release
CLI := $(RELEASE)/bin/omentum
export CMAKE_BUILD_PARALLEL_LEVEL := $(JOBS)

.PHONY: help setup python configure build wheel demo check check-all slow arm64 container mutants tsan bench figures pictures gallery keys doc install format fuzz tidy clean
.DEFAULT_GOAL := help

help: ## this list
	@sed -n 's/^\([a-z0-9-]*\):.*## \(.*\)/  make \1|\2/p' Makefile | \
	    while IFS='|' read -r cmd what; do printf '%-16s %s\n' "$$cmd" "$$what"; done

setup: ## install the missing packages of packages.txt
	@tools/setup.sh packages.txt

python: setup ## the environment of the Python tests, in build/python, with what PyPI has
	@tools/python_env.sh

configure: setup
	@test -f $(RELEASE)/build.ninja || cmake --preset release -G Ninja

build: configure ## build the optimised library and the program
	@cmake --build $(RELEASE)

demo: build ## from a CT made here to an exposed tumour; report in out/demo
	@$(CLI) demo -o out/demo
	@echo; echo "The program is ./omentum, in this folder: ./omentum help"
	@echo "README.md has more examples; make install puts it on PATH."

check: setup python ## format, layers, quick tests in release, sanitizers where it matters; ROOM=match: one room
	@tools/check.sh $(ROOM)

check-all: setup python ## check, and the slow tests, thread sanitizer, benchmarks, MPI, arm64, mutants: hours
	@tools/setup.sh tools/packages_ci.txt || echo "check-all: without Open MPI; its tests are skipped"
	@tools/setup.sh tools/packages_wheel.txt || echo "check-all: without SuperLU; the build without GPL parts is skipped"
	@tools/setup.sh tools/packages_arm64.txt || echo "check-all: without the emulator of arm64; its tests are skipped"
	@tools/python_env.sh python/requirements_slow.txt
	@tools/check.sh --all

slow: build python ## the tests that take minutes
	@cmake --build $(RELEASE) --target tests
	@tools/python_env.sh python/requirements_slow.txt
	@ctest --test-dir $(RELEASE) -L slow --output-on-failure

arm64: setup ## build for arm64, and the quick tests in an emulator (hours)
	@tools/setup.sh tools/packages_arm64.txt
	@tools/arm64.sh

container: ## the image of Containerfile by buildah, and the demo in it (needs root)
	@tools/setup.sh tools/packages_container.txt
	@tools/container.sh

mutants: setup ## change one line of src/ or studies/ at a time: does a test notice? (hours; a run that was stopped goes on)
	@tools/mutants.py

tsan: setup ## the quick tests under the thread sanitizer
	@cmake --preset tsan -G Ninja > /dev/null && cmake --build build/tsan --target tests
	@ctest --test-dir build/tsan -LE "slow|cli|sample" --output-on-failure

bench: build python ## timings, one JSON object a line
	@cmake --build $(RELEASE) --target omentum_bench
	@OMP_WAIT_POLICY=active $(RELEASE)/bin/omentum_bench
	@tools/python_run.sh python/bench.py

keys: build ## doc/scene_keys.md from the tables of the scene reader
	@build/release/bin/omentum retract --keys > doc/scene_keys.md

figures: ## copy README's figures from doc/figures.md; list the figures whose code has changed since they were measured
	@python3 tools/readme_figures.py
	@python3 tools/check_figures.py

pictures: build ## the pictures of doc/view.md, made again in Chromium (needs node, build/node as in .ci/run)
	@NODE_PATH=build/node/node_modules node test/view/pictures.js $(RELEASE)/bin/omentum scenes doc/images

gallery: build ## the pictures of doc/gallery.md, made again by the commands that it prints (ten minutes)
	@python3 tools/gallery.py

doc: build ## the site: pages, gallery, tutorials, commands, headers; build/doc/html/index.html (needs doxygen)
	@command -v doxygen > /dev/null || { echo "make doc: doxygen is missing; install the package doxygen" >&2; exit 1; }
	@rm -rf build/doc && python3 tools/site_pages.py $(CLI) build/doc/pages
	@OM_VERSION=$$(sed -n 's/^#define OM_VERSION "\(.*\)"/\1/p' include/omentum/base.h) doxygen doc/Doxyfile
	@python3 tools/site_finish.py build/doc/html
	@echo "build/doc/html/index.html"

install: build ## install into PREFIX (default /usr/local), below DESTDIR
	@DESTDIR="$(DESTDIR)" cmake --install $(RELEASE) --prefix "$(PREFIX)"

wheel: setup ## the wheel of the Python package, in build/wheel (needs PyPI)
	@tools/setup.sh tools/packages_wheel.txt
	@tools/wheel.sh

format: setup ## rewrite the C files in the project's format
	@tools/list_c.sh | xargs -0 clang-format -i

tidy: ## clang-tidy over the library (needs clang-tidy)
	@tools/setup.sh packages.txt tools/packages_clang.txt
	@cmake --preset release -G Ninja
	@find src studies -name '*.c' -print0 | xargs -0 -P $(JOBS) -n 1 clang-tidy --quiet -p $(RELEASE)

fuzz: ## every parser for FUZZ_SECONDS (default 300), with line coverage (needs clang)
	@tools/setup.sh packages.txt tools/packages_clang.txt
	@tools/fuzz.sh $(FUZZ_SECONDS)

clean: ## remove what was built
	@rm -rf build out
