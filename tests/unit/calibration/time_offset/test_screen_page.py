"""The time pattern's page: the browser draws what the image reader expects, and nothing is loaded from outside."""

import json
import re

from phone_host.calibration.time_offset.screen import COUNT, HEIGHT, WIDTH, PatternReader, draw, pattern_page


def test_the_page_has_the_pattern_and_needs_nothing_else() -> None:
    """Size, count and cells in the page are those that the reader expects, and the page holds no address."""
    page = pattern_page()
    found = re.search(r"const p = (\{.*?\}), canvas", page)
    assert found is not None
    values = json.loads(found[1])
    assert (values["width"], values["height"], values["count"]) == (WIDTH, HEIGHT, COUNT)
    assert 2 ** values["coded"] == COUNT
    assert len(values["places"]) >= values["coded"]
    assert "http" not in page
    assert "src=" not in page


def test_what_the_page_would_draw_is_read() -> None:
    """Squares drawn from the page's own values, where its script puts them, are read as the number."""
    values = json.loads(re.search(r"const p = (\{.*?\}), canvas", pattern_page())[1])  # type: ignore[index]  # the test above
    unit, number = 12, 1234
    image = draw(0, unit)
    image[:] = 255
    for (x, y), bits in zip(values["markers"], values["bits"], strict=True):
        for j, row in enumerate(bits):
            for i, white in enumerate(row):
                if not white:
                    image[(y + j) * unit : (y + j + 1) * unit, (x + i) * unit : (x + i + 1) * unit] = 0
    code, cell = number ^ (number >> 1), values["cell"]
    for bit in range(values["coded"]):
        if code >> bit & 1:
            x, y = (round(at * unit) for at in values["places"][bit])
            image[y : y + round(cell * unit), x : x + round(cell * unit)] = 0
    reading = PatternReader().read(image)
    assert reading is not None
    assert reading.number == number
