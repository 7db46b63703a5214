# The tasks of this repository; `make` alone lists them.
.DEFAULT_GOAL := help
.PHONY: help setup demo lint wheels test tests-of-a-commit test-ui test-engines test-all bench docs site gallery pictures styles zip lock clean

PYTHON = .venv/bin/python
OUT = out

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/\1|\2/' | \
	    awk -F '|' '{ printf "  make %-13s %s\n", $$1, $$2 }'

setup: ## make .venv from the lock file, unless it is up to date
	@tools/setup

STYLE = long_wavy

demo: setup ## the whole pipeline, on STYLE=bob or a groom: GROOM=x.tfx HEAD=x.obj COLLIDER=x.obj OPTIONS="..." OUT=out, all optional
	$(PYTHON) tools/headless.py demo $(if $(GROOM),--groom "$(GROOM)",--style $(STYLE)) $(if $(HEAD),--head "$(HEAD)") \
	    $(if $(COLLIDER),--collider "$(COLLIDER)") --output "$(OUT)" $(OPTIONS)

lint: setup
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	@mkdir -p out/typed && ln -sfn ../.. out/typed/hairloom
	.venv/bin/mypy

# Tests that draw come first: they are the longest, and none should run alone at the end.
TESTS = tests/blender tests/gpu tests/pure
# One thread each: OpenBLAS's threads wait for each other by spinning, on busy processors.
PYTEST = OPENBLAS_NUM_THREADS=1 $(PYTHON) -m pytest -q -n 2 --dist worksteal

# To show the values of an assert, pytest rewrites all tests, which takes each process as long as a
# hundred tests. So only failed tests are run with it, a second time; the target fails all the same.
# For a commit, shaders are compiled without LLVM's optimization, which takes longer than running them.
tests-of-a-commit: export GALLIVM_PERF = nopt
tests-of-a-commit: setup
	$(PYTEST) -m "not slow" --assert=plain $(TESTS) || \
	    { $(PYTHON) -m pytest -q -m "not slow" --last-failed --last-failed-no-failures=none $(TESTS); false; }

# In parallel: mypy keeps one processor busy, the longest tests come first, and fetching the zips'
# wheels takes little of a processor.
test: setup ## lint, types, and the tests for a commit that need no window
	@$(PYTHON) tools/timings.py test_minutes $(MAKE) --no-print-directory -j 3 wheels lint tests-of-a-commit

wheels: setup
	@$(PYTHON) tools/fetch_wheels.py

test-ui: zip ## tests in a Blender with a window, on OpenGL and Vulkan; SESSIONS="session_x" for some
	tools/window_blender install
	$(PYTHON) tools/test_ui.py $(SESSIONS)

test-all: lint zip ## all tests, on both backends: before an issue is resolved
	$(PYTEST) $(TESTS)
	tools/window_blender install
	$(PYTHON) tools/test_ui.py --all
	$(PYTHON) -m pytest -q tests/engines

test-engines: setup ## compare exported cards, drawn by Godot and by three.js, with our own picture
	$(PYTHON) -m pytest -q tests/engines

bench: setup ## NAME=x runs bench/x.py; without NAME all, short, into docs/figures.md, half an hour
	@$(PYTHON) tools/$(if $(NAME),bench.py $(NAME),figures.py)

docs: setup ## write the parts of the documentation that come from the code
	$(PYTHON) tools/make_docs.py

site: setup ## the documentation as a site in out/site, to be read from the folder or put on a server
	$(PYTHON) tools/make_site.py

gallery: setup ## draw docs/gallery.md: looks, stages, skins, kinds of hair, cards; NAME=x for one picture
	$(PYTHON) tools/gallery.py $(NAME)

pictures: setup ## draw the documentation's pictures again
	$(PYTHON) tools/make_docs.py --pictures

styles: setup ## make hairstyles/ from the recipes, with pictures in out/styles; NAME=x for one
	$(PYTHON) tools/make_styles.py --pictures $(OUT)/styles $(NAME)

zip: wheels ## the extension's zips, one for each build of Blender, into dist/
	@rm -rf dist && mkdir dist
	$(PYTHON) tools/make_zips.py dist
	$(PYTHON) tools/bill_of_materials.py dist/hairloom.cdx.json

lock: ## write requirements.lock again from requirements.in (needs uv)
	uv pip compile --quiet --universal --generate-hashes --python-version 3.13 --upgrade \
	    --no-emit-index-url --custom-compile-command "make lock" requirements.in -o requirements.lock

clean: ## remove what was made here, except .venv and the window Blender
	rm -rf out dist help .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
