# Needs Rust, a C compiler and Python's pip; `make setup` fetches the rest into this folder.

# The native backends need no setup. Where Embree cannot be had, `make demo` goes on without it;
# `make test` does so only if SATO_NATIVE_ONLY=1 says so.

CARGO ?= cargo
TARGET_DIR = $${CARGO_TARGET_DIR:-target}

.PHONY: help demo test lint setup clean

help:
	@echo 'make demo   build, then compare native backends with Embree: images and a report in out/demo'
	@echo 'make test   the whole test suite, Embree included (SATO_NATIVE_ONLY=1: without it)'
	@echo 'make lint   formatting, clippy and documentation, with and without Embree'
	@echo 'make setup  fetch Embree 4 and libclang into third-party/ unless the system has them'
	@echo 'make clean  remove what the others made'

demo:
	@if sh scripts/setup.sh; then \
	    features='--features embree'; embree='--backend embree --backend embree:mode=robust'; \
	else \
	    echo 'demo: going on with the native backends only' >&2; features=; embree=; \
	fi; \
	$(CARGO) build --release $$features && \
	"$(TARGET_DIR)/release/sato" compare scenes/atrium.toml \
	    --backend bvh2:order=near --backend bvh2 --backend bvh8 $$embree -o out/demo

test:
	@if [ "$$SATO_NATIVE_ONLY" = 1 ]; then \
	    echo 'test: SATO_NATIVE_ONLY=1, so without Embree'; $(CARGO) test; \
	elif sh scripts/setup.sh; then \
	    $(CARGO) test --features embree; \
	else \
	    echo 'test: no Embree to test with; SATO_NATIVE_ONLY=1 make test goes without it' >&2; exit 1; \
	fi

lint:
	@sh scripts/setup.sh
	$(CARGO) fmt --check
	$(CARGO) clippy --all-targets -- -D warnings
	$(CARGO) clippy --all-targets --features embree -- -D warnings
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc --no-deps --features embree

setup:
	@sh scripts/setup.sh

clean:
	$(CARGO) clean
	rm -rf third-party out
	@if head -n 1 .cargo/config.toml 2>/dev/null | grep -q 'Written by scripts/setup.sh'; then \
	    rm .cargo/config.toml; \
	fi
