# Two commands for a fresh machine: `make reproduce` and `make test`. Both set up what they need.
.PHONY: setup full reproduce lint test quick checkers coverage docs pictures soak lock reference clean

setup: .venv/.ready

.venv/.ready: requirements/dev.txt requirements/uv.txt pyproject.toml scripts/setup
	scripts/setup dev

# with the console and the participant's screen: PsychoPy and Qt
full: .venv/.ready-full

.venv/.ready-full: requirements/full.txt requirements/uv.txt pyproject.toml scripts/setup
	scripts/setup full

reproduce: setup
	.venv/bin/recoil reproduce

# Style, types and contracts of imports
lint: full
	scripts/lint

test: full
	scripts/system-packages
	scripts/test

# What a developer runs every few minutes: all but the tests that are marked slow
quick: full
	scripts/test --numprocesses $(shell nproc) -m "not soak and not slow"

# What others' programs say of the package: its metadata, wheel and citation
checkers: setup
	scripts/checkers

# Lines and branches that the tests reach, the programs that they start included
coverage: full
	scripts/system-packages
	scripts/test --cov --cov-report term

.venv/.ready-docs: requirements/full.txt requirements/docs.txt requirements/uv.txt pyproject.toml scripts/setup
	scripts/setup docs

# The pages under docs/ as a site in docs/_build/html; every command and block of code in them and in the README is run
docs: .venv/.ready-docs
	.venv/bin/python -m docs.generate
	.venv/bin/python -m docs.run_blocks
	.venv/bin/sphinx-build --fail-on-warning --keep-going --quiet --fresh-env docs docs/_build/html

# The pictures in docs/pictures, made again: the console and the participant's screen on a virtual display, and figures
pictures: .venv/.ready-docs
	scripts/system-packages
	.venv/bin/python -m docs.pictures

# The full figures of every promise, kept as tables under results/soak/
soak: full
	scripts/system-packages
	rm -f results/soak/*.md
	PATH="$(CURDIR)/.venv/bin:$$PATH" .venv/bin/pytest -m soak --timeout 0 --durations 10

# The locks, from pyproject.toml
lock:
	scripts/lock

# The one result that is committed, remade from nothing; `make pictures` takes a picture of its page
reference: setup
	rm -rf results/reference
	.venv/bin/recoil reproduce --out results/reference
	rm -rf results/reference/logs results/reference/reproduction.json

clean:
	rm -rf .venv .tools dist .pytest_cache .coverage .mypy_cache .ruff_cache .hypothesis
