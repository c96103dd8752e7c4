"""Examples in the documentation that Python can run give what stands below them."""

import doctest

import pytest


@pytest.mark.parametrize("page", ["score.md"])
def test_examples_of_a_page(repository, page):
    """None fails, and there are some."""
    found = doctest.testfile(str(repository / "docs" / page), module_relative=False)
    assert found.failed == 0
    assert found.attempted >= 5
