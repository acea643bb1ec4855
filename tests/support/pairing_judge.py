"""What the best pairing of two streams is, found offline by dynamic programming: the judge of the pairing that has to decide at once."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, order=True)
class Score:
    """A pairing's worth: most pairs first, then least total time skew; greater is better."""

    pairs: int
    minus_skew_ns: int


def best_score(board_ns: list[int], host_ns: list[int], tolerance_ns: int) -> Score:
    """The best that an ordered one-to-one pairing within the tolerance can reach."""
    best = [Score(0, 0)] * (len(host_ns) + 1)
    for board in board_ns:
        row = [Score(0, 0)]
        for j, host in enumerate(host_ns):
            options = [best[j + 1], row[j]]
            if abs(board - host) <= tolerance_ns:
                options.append(Score(best[j].pairs + 1, best[j].minus_skew_ns - abs(board - host)))
            row.append(max(options))
        best = row
    return best[-1]
