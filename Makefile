# Each of these does all its own set-up: it needs only python3 (3.11 or later), make and this checkout.
#   make demo     the generated recording, imported and boxed, opened in the browser
#   make test     the tests
#   make check    format, lint, types and who may import whom, of the page too
#   make types    the page's types of the API, from its OpenAPI document
#   make format   let ruff put the format right

PYTHON ?= python3
BIN := .venv/bin
PINNED := pyproject.toml setup.py constraints.txt .ci/environment

.PHONY: demo test check types format
.DELETE_ON_ERROR:

demo: .venv/runtime.stamp
	$(BIN)/ars-web demo

# How the tests are spread when all are run; tests/conftest.py says which go together and in which order.
SPREAD := -n 2 --dist loadfile --no-loadscope-reorder

# All of them in two steps, since a process that drives a browser has an event loop that never ends, beside which no test
# can have its own. `make test ARGS="tests/api -q"` runs some, in one process. Bytecode is kept whatever the environment
# says: the tests start hundreds of processes, each of which would compile the whole package first.
test: export PYTHONDONTWRITEBYTECODE =
test: .venv/dev.stamp
	ARS_WEB_CHROMIUM="$$(.ci/chromium)" && export ARS_WEB_CHROMIUM && if [ -n "$(ARGS)" ]; then \
	    $(BIN)/python -m pytest $(ARGS); \
	else \
	    $(BIN)/python -m pytest $(SPREAD) --ignore tests/browser && $(BIN)/python -m pytest $(SPREAD) tests/browser; \
	fi

check: .venv/dev.stamp
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/lint-imports
	.ci/page check

types: .venv/dev.stamp
	.ci/page types

format: .venv/dev.stamp
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

.venv/runtime.stamp: $(PINNED)
	@PYTHON="$(PYTHON)" .ci/environment runtime
	@touch $@

.venv/dev.stamp: $(PINNED)
	@PYTHON="$(PYTHON)" .ci/environment dev
	@touch .venv/runtime.stamp $@
