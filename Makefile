# All that one does here, in one place. `make` alone lists it.
.DEFAULT_GOAL := help
.PHONY: help setup demo test test-ui test-engines bench docs pictures zip lock clean

PYTHON = .venv/bin/python
OUT = out

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/\1|\2/' | \
	    awk -F '|' '{ printf "  make %-13s %s\n", $$1, $$2 }'

setup: ## make .venv from the lock file; nothing to do when it is there
	@tools/setup

demo: setup ## the whole way on a groom: GROOM=x.tfx HEAD=x.obj COLLIDER=x.obj OUT=out, all optional
	$(PYTHON) tools/headless.py demo $(if $(GROOM),--groom "$(GROOM)") $(if $(HEAD),--head "$(HEAD)") \
	    $(if $(COLLIDER),--collider "$(COLLIDER)") --output "$(OUT)"

test: setup ## lint, types, and all tests that need no window
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	$(PYTHON) -m pytest -q -n auto tests/pure
	$(PYTHON) -m pytest -q -n 2 --dist loadfile tests/gpu tests/blender

test-ui: zip ## the tests in a Blender with a window, OpenGL and Vulkan; SESSIONS="session_x" for some
	tools/window_blender install
	$(PYTHON) tools/test_ui.py $(SESSIONS)

test-engines: setup ## exported cards drawn by Godot and by three.js, held against our own picture
	$(PYTHON) -m pytest -q tests/engines

bench: setup ## one benchmark: NAME=x runs bench/x.py, no NAME lists them
	@$(PYTHON) tools/bench.py $(NAME)

docs: setup ## write what the documentation takes from the code
	$(PYTHON) tools/make_docs.py

pictures: setup ## draw the documentation's pictures anew
	$(PYTHON) tools/make_docs.py --pictures

zip: setup ## the extension's zip, into dist/
	@$(PYTHON) tools/fetch_wheels.py
	@rm -rf dist && mkdir dist
	$(PYTHON) .venv/lib/python*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py \
	    build --source-dir . --output-dir dist

lock: ## write requirements.lock anew from requirements.in (needs uv)
	uv pip compile --quiet --universal --generate-hashes --python-version 3.13 --upgrade \
	    --no-emit-index-url --custom-compile-command "make lock" requirements.in -o requirements.lock

clean: ## remove what was made here, except .venv and the window Blender
	rm -rf out dist .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
