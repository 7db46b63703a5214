"""The number of runs under load that have passed in a row."""

import pytest
from load_runs import Run, passed_in_a_row


@pytest.mark.parametrize(
    ("codes", "in_a_row"), [([], 0), ([0, 0], 2), ([1], 0), ([0, 2], 0), ([0, 2, 0, 0], 2)]
)
def test_runs_count_since_the_last_that_failed(codes: list[int], in_a_row: int) -> None:
    runs = [Run(commit="0" * 8, date="2026-11-28 14:00", minutes=35.0, code=code) for code in codes]
    assert passed_in_a_row(runs) == in_a_row
