"""What one would say without a diagnosis: answers to beat, whatever a question's folder is called."""

import pytest
from support.plants.gap_rigs import baselines, session

from rig.blind_check.naive import naive_answers
from rig.gap.hypotheses.library import LIBRARY


@pytest.mark.parametrize("folder", ["case_01", "0f3a", "a case of June"])
def test_a_random_name_is_drawn_by_the_name_of_the_folder(folder: str) -> None:
    days = [list(day) for day in baselines()]
    said = [naive_answers(session(71), days, folder, True)["random"] for _ in range(2)]
    assert said[0] == said[1]
    assert said[0] in {"none", *LIBRARY}
