# Entry points. Every target installs what it needs first (./setup, quick where nothing is missing).
.PHONY: help demo test faults build package bench recordings format lint docs coverage clean

help:
	@echo "make demo      build, then a drive over a simulated Mars (or INPUT=path); demo_output/report.html shows it"
	@echo "make test      build, then run the fast tests"
	@echo "make faults    long runs under injected faults and with damaged inputs; prints both tables (hours)"
	@echo "make build     the program: build/release/bin/spartan"
	@echo "make package   Debian packages and a Python wheel: build/packages"
	@echo "make bench     all benchmarks; make bench-NAME: the one of bench/NAME.cpp"
	@echo "make recordings  the standard simulated recordings, once, into ~/.cache/spartan (an hour)"
	@echo "make format    format the C++ files"
	@echo "make lint      clang-tidy on what changed since the commit in .ci/lint-base (or LINT_BASE=commit, LINT_BASE=all)"
	@echo "make docs      the documentation site with the references of C++ and Python: build/docs/site/index.html"
	@echo "make coverage  lines and branches that the fast tests reach, by module"
	@echo "make clean     remove what was built"

build:
	./setup build
	scripts/build release

package:
	./setup build package
	scripts/package

demo:
	./setup build
	scripts/build release spartan_program
	scripts/demo

test:
	./setup build test
	scripts/build release -DSPARTAN_PYTHON=ON
	ctest --preset release -j $$(nproc)

faults:
	./setup build test
	scripts/build release
	scripts/faults $(ARGS)

bench:
	./setup build develop
	scripts/build release -DSPARTAN_BENCH=ON spartan_bench
	scripts/bench

bench-%:
	./setup build develop
	scripts/build release -DSPARTAN_BENCH=ON bench_$*
	build/release/bench/$* $(ARGS)

recordings:
	./setup build
	scripts/build release spartan_program
	scripts/recordings $(ARGS)

format:
	./setup develop
	scripts/format

lint:
	./setup build test develop
	scripts/lint

docs:
	./setup build test docs site
	mkdir -p build/docs
	scripts/site --api
	@echo "open build/docs/site/index.html"

coverage:
	./setup
	scripts/coverage

clean:
	rm -rf build demo_output/recording demo_output/run demo_output/kitti demo_output/report.html
