"""`arlight table`: one row for every tilt and width."""


def test_a_row_for_every_clip(arlight):
    done = arlight("table", "--order", 1, "--tilts-deg", 20, "--widths-px", 200, 300, "--frames", 2)
    assert done.status == 0, done.errors
    rows = [line.replace("│", " ").split() for line in done.output.splitlines()]
    numbers = [row for row in rows if row[:1] == ["20"]]
    assert [row[1] for row in numbers] == ["200", "300"]
    # filtered, single frame and bound of both orders, in one line
    assert all(row.count("/") == 4 for row in numbers)


def test_an_unknown_environment_is_refused(arlight):
    done = arlight("table", "--environment", "nowhere")
    assert done.status == 1
    assert "nowhere" in done.errors
