"""Mitsuba is optional: what is missing is said, with what to install."""

import importlib

import pytest

from arlight.validation import mitsuba_library
from arlight.validation.mitsuba_library import ValidationUnavailableError, load_mitsuba


def test_without_mitsuba_the_message_says_what_to_install(monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ValidationUnavailableError, match=r"arlight\[validate\]"):
        load_mitsuba()


def test_without_llvm_the_message_names_the_package_and_the_variable(monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr(mitsuba_library, "_LLVM_PLACES", ())
    monkeypatch.setattr(importlib, "import_module", lambda _name: object())
    with pytest.raises(ValidationUnavailableError, match=r"libllvm19.*DRJIT_LIBLLVM_PATH"):
        load_mitsuba("llvm_ad_rgb")


def test_a_variant_that_cannot_be_set_is_refused(monkeypatch):
    class Broken:
        def set_variant(self, variant):
            raise ImportError(f"no variant {variant}")

    monkeypatch.setattr(importlib, "import_module", lambda _name: Broken())
    with pytest.raises(ValidationUnavailableError, match="scalar_rgb cannot be loaded"):
        load_mitsuba()


@pytest.mark.usefixtures("path_tracer")
def test_the_scalar_variant_traces():
    assert load_mitsuba().variant() == "scalar_rgb"
