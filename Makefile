# make demo   the main job: generate pushes, score them, compare with the ground truth, draw
# make test   all tests, C++ and Python
# make check  formats and types        make format  put them right
# make bench  speed                    make clean   forget everything built
#
# Each target installs what is missing first: Debian packages with apt, the rest in .venv.

PYTHON ?= python3
PACKAGES := cmake g++ ninja-build libbullet-dev libompl-dev libeigen3-dev nlohmann-json3-dev libvalijson-dev libgtest-dev \
            libbenchmark-dev python3-venv python3-dev
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
BIN := .venv/bin
SOURCES := $(shell find cpp cmake tests/cpp -type f) CMakeLists.txt python/energymargin/problem.schema.json

.PHONY: demo test bench check format stubs clean
.DELETE_ON_ERROR:

demo: .venv/built
	$(BIN)/energymargin demo

test: .venv/built
	$(BIN)/ctest --test-dir build --output-on-failure --parallel 2
	$(BIN)/python -m pytest

bench: .venv/built
	build/cpp/bench/energymargin_bench

check: .venv/built
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror $$(git ls-files '*.hpp' '*.cpp')

format: .venv/built
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/clang-format -i $$(git ls-files '*.hpp' '*.cpp')

stubs: .venv/built
	$(BIN)/python -m pybind11_stubgen energymargin._core -o python --enum-class-locations .+:_core

clean:
	rm -rf .venv build

.venv/packages: Makefile
	@missing=$$(dpkg-query -W -f '$${Package} $${Status}\n' $(PACKAGES) 2>/dev/null | awk '$$4 == "installed" {print $$1}' \
	  | sort > /tmp/energymargin-have.$$$$; printf '%s\n' $(PACKAGES) | sort | comm -23 - /tmp/energymargin-have.$$$$; \
	  rm -f /tmp/energymargin-have.$$$$); \
	if [ -n "$$missing" ]; then \
	  echo "Installing Debian packages:" $$missing; \
	  $(SUDO) apt-get update -qq && $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $$missing >/dev/null; \
	fi
	@mkdir -p .venv && touch $@

.venv/environment: .venv/packages pyproject.toml
	@echo "Setting up .venv"
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install -q --upgrade pip
	@$(BIN)/python -m pip install -q 'scikit-build-core>=0.10' 'pybind11>=3.0' cmake
	@touch $@

.venv/built: .venv/environment $(SOURCES)
	@echo "Building energymargin"
	@$(BIN)/python -m pip install -q --no-build-isolation -e '.[dev]' -Cbuild-dir=build \
	  -Ccmake.define.ENERGYMARGIN_TESTS=ON -Ccmake.define.ENERGYMARGIN_BENCH=ON
	@touch $@
