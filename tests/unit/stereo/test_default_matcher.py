"""Which matcher is used when nobody names one, and what summaries say of it."""

from dataclasses import replace
from pathlib import Path

import pytest

from common.diagnostic import Diagnostic
from common.errors import SettingsError, UnavailableError
from common.program.settings import resolve
from phone_host.declared_settings import PhoneHostSettings
from phone_host.native.library import Library, load, native, required
from phone_host.report.run_json import build
from phone_host.report.summary import summary
from phone_host.settings import matcher_is_given, resolve_settings
from phone_host.stereo.default_matcher import default_matcher, default_note
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import BEST_FIRST, FALLBACK, PREFERRED, MatcherName, default_words
from tests.support import run_snapshots

NOT_BUILT = Diagnostic(message="not built: no C compiler", remedy="install gcc")


def test_the_preferred_matcher_gives_way_where_the_library_is_missing() -> None:
    """Without a library a preferred tandem becomes sgbm, and one sentence says why and what to do; sgbm stays sgbm and says nothing."""
    assert default_matcher(MatcherName.TANDEM, NOT_BUILT) is MatcherName.SGBM
    note = default_note(MatcherName.TANDEM, NOT_BUILT)
    assert note == "own matcher not built: no C compiler; sgbm is used; install gcc"
    assert default_matcher(MatcherName.SGBM, NOT_BUILT) is MatcherName.SGBM
    assert default_note(MatcherName.SGBM, NOT_BUILT) == ""


def test_the_preferred_matcher_is_used_where_the_library_is_there() -> None:
    """With a library tandem and sgbm are each what they were asked for, without a note."""
    library = native()
    assert isinstance(library, Library)
    for preferred in (MatcherName.TANDEM, MatcherName.SGBM):
        assert default_matcher(preferred, library) is preferred
        assert default_note(preferred, library) == ""
    assert default_matcher() is PREFERRED
    assert MatchSettings().matcher is PREFERRED


def test_tandem_without_its_library_is_refused_with_a_remedy(tmp_path: Path) -> None:
    """Who asks for tandem where it is not built gets one line that says how to build it and what works meanwhile; exit 3."""
    with pytest.raises(UnavailableError) as caught:
        required(load(tmp_path))
    assert str(caught.value).startswith("matcher tandem is not built: install gcc or clang")
    assert str(caught.value).endswith("or use --matcher sgbm")
    assert caught.value.exit_code == 3
    assert isinstance(required(native()), Library)


def test_the_settings_name_the_matcher_that_is_used() -> None:
    """The setting nobody gave shows the default matcher's name, with its origin; a name that was given stays."""
    usual = resolve_settings({"config": None})
    assert usual.values.matcher == PREFERRED.value
    assert not matcher_is_given(usual)
    named = resolve_settings({"config": None, "matcher": "block"})
    assert named.values.matcher == "block"
    assert matcher_is_given(named)
    assert resolve(PhoneHostSettings, "NONE", None, {}).values.matcher == ""


def test_an_empty_name_in_the_environment_is_no_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """A variable that is set to nothing is a mistake, as any unknown name."""
    monkeypatch.setenv("PHONE_HOST_MATCHER", "")
    assert resolve_settings({"config": None}).values.matcher == ""


def test_the_note_of_a_run_stands_in_its_summary_once_and_in_its_report() -> None:
    """A run that had to take another matcher says so in one line; other runs say nothing."""
    usual = run_snapshots.run(31)
    assert build(usual)["matcher_note"] is None
    assert "own matcher" not in summary(usual)
    noted = replace(usual, matcher_note=default_note(MatcherName.TANDEM, NOT_BUILT))
    assert build(noted)["matcher_note"] == noted.matcher_note
    assert summary(noted).count(f"note: {noted.matcher_note}\n") == 1


def test_help_names_the_default() -> None:
    """Help says which matcher is the default, and what stands in for it."""
    assert default_words(FALLBACK) == "default sgbm"
    assert default_words(MatcherName.TANDEM) == "default tandem, or sgbm where the native library is not built"
    assert next(iter(BEST_FIRST)) is MatcherName.TANDEM


@pytest.mark.parametrize("variable", ["avx9", "AVX2", " "])
def test_a_wrong_instruction_set_is_refused_by_name(variable: str) -> None:
    """`TANDEMSCAN_SIMD` that names no instruction set is refused with the ones that can be given."""
    library = native()
    assert isinstance(library, Library)
    with pytest.raises(SettingsError, match=r"is no instruction set: give .*scalar"):
        load(library.path.parent, variable)
