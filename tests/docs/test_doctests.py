"""Examples in the documentation that Python can run give what stands below them."""

import doctest

import pytest


@pytest.mark.parametrize(("page", "n"), [("score.md", 5), ("explanation/model.md", 3)])
def test_examples_of_a_page(repository, page, n):
    """None fails, and there are some."""
    found = doctest.testfile(str(repository / "docs" / page), module_relative=False)
    assert found.failed == 0
    assert found.attempted >= n
