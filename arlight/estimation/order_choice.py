"""The order of light that a scene requires: what the object shows of each order against how well the data tell it.

Orders that noise drowns make the picture worse, and what the object or the light has little of makes no difference.
Measuring less saves work, so the lowest order is chosen that costs next to nothing.
"""

import math

import numpy as np

from arlight.estimation.drawn_light import DrawnLight
from arlight.estimation.lighting import Lighting
from arlight.estimation.natural_light import PriorKnowledge
from arlight.estimation.shown_light import Need, ShownLight

_LOOK_EVERY_S = 2.0
"""Time after which all orders are measured once more [s]."""
_JUDGE_EVERY_S = 0.8
"""Time between two frames in which the order is thought over, half of it where a lower one may do, and less while
little has been seen [s]."""
_LOWEST = 1
"""Lowest order that is chosen, where the sheet has it: a level alone does not tell one light from another."""
_STANDS_OUT = 4.0
"""Standard deviations by which a frame must show more than usual, or squared errors by which the light must change, for
all orders to be followed again; twice as many after every time that it was in vain, until the light changes."""
_LOWER_AFTER_S = 0.8
"""Time for which a lower order must have sufficed before it is taken [s]."""
_KEPT = 0.95
"""Of the most that frames showed, from one time that the order is thought over to the next."""
_STEP = 0.5
"""Change of what the followed parts show, relative to its size, with which a light is another one."""


class OrderChoice:
    """Chooses the order to measure and draw in every frame.

    Args:
        prior: what is known of light before the sheet measures it.
        need: what of the light is wanted.
    """

    def __init__(self, prior: PriorKnowledge, need: Need) -> None:
        self._light = ShownLight(prior, need)
        self._drawn = DrawnLight(len(need.independent))
        self.highest, self._tolerance = self._light.highest, need.tolerance
        self._lowest = min(_LOWEST, self.highest)
        self.reset()

    def reset(self) -> None:
        """Forget the light."""
        self._light.reset()
        self._drawn.reset()
        self.order = self.highest
        """Highest order that is followed."""
        self._core, self._leaving = self.highest, False
        self._learnt_s = self._began_s = -math.inf
        self._left_out = 0.0
        self._doubt = _STANDS_OUT
        self._rose = self._suspected = self._jumped = False
        self._usual = np.zeros(self.highest + 1)
        self._looked_s = self._judged_s = -math.inf
        self._fits_since_s = math.inf
        self._strength = self._lately = 0.0
        self._unsure = math.inf

    def order_to_measure(self, time_s: float) -> int:
        """Highest order to measure in the frame at a time [s]: the chosen one, now and then all."""
        return self.highest if time_s - self._looked_s >= _LOOK_EVERY_S else self.order

    def learn(self, seen: Lighting, filtered: Lighting, time_s: float) -> None:
        """Take in a frame's own lighting and the filtered one, of the order that was measured or less.

        Not every frame is worth the work.
        """
        self._fade(time_s)
        if len(seen.frequencies) > len(filtered.frequencies):
            self._looked_s = time_s
            self._look(seen)
        if self._leaving or filtered.order > self.order:
            return
        self._suspected = filtered.order >= self._core and self._is_suspect(filtered)
        if not self._suspected and self._is_to_judge(time_s):
            self._began_s = time_s if math.isinf(self._began_s) else self._began_s
            self._judged_s = time_s
            self._judge(seen, filtered, time_s)

    def shown(self, filtered: Lighting) -> Lighting:
        """The filtered lighting as it is drawn: less of what is hardly known, and of orders that come or go."""
        if filtered.order > self.order:
            filtered = filtered.truncated(self.order)
        return self._light.drawn(filtered, self._drawn)

    def _fade(self, time_s: float) -> None:
        """Let what is drawn change by what it may since the last frame."""
        self._drawn.wait(time_s - self._learnt_s)
        self._learnt_s = time_s
        if self._leaving and self._drawn.settled:
            self.order, self._leaving = self._core, False

    def _is_to_judge(self, time_s: float) -> bool:
        """Whether the order is to be thought over in a frame at a time [s]."""
        soon = 0.5 if math.isfinite(self._fits_since_s) else 1.0
        return not 0.0 <= time_s - self._judged_s < min(soon * _JUDGE_EVERY_S, time_s - self._began_s)

    def _is_suspect(self, filtered: Lighting) -> bool:
        """Whether the light seems another one than that which was judged; once that is certain, it is begun anew with.

        One frame would hardly tell, for what a second of them averages may be far below the noise of each; nor may the
        filter's first one of another light be trusted, so that the next has to say the same. A light that jumps is
        drawn as another one at once, one that drifts little by little.
        """
        strength = self._light.strength(filtered, self._core)
        changed, jumped = self._differs(strength, self._strength), self._differs(strength, self._lately)
        certain, jumps = changed and self._suspected, jumped or self._jumped
        self._lately, self._jumped = strength, jumped
        if certain and jumps:
            self.reset()
        elif certain:
            self._rise()
            # what was learnt of noise was another light's
            self._usual[:], self._doubt, self._rose = 0.0, _STANDS_OUT, False
        return changed and not certain

    def _differs(self, strength: float, other: float) -> bool:
        change = abs(strength - other)
        return change > _STEP * max(strength, other) and change > self._doubt * self._unsure

    def _rise(self) -> None:
        """Follow all orders, to be seen little by little."""
        self.order, self._left_out, self._fits_since_s, self._rose = self.highest, 0.0, math.inf, True
        # what the filter makes of them is not known yet
        self._began_s, self._judged_s, self._unsure = -math.inf, -math.inf, math.inf

    def _look(self, seen: Lighting) -> None:
        """Follow all orders again if one frame shows more of them than any did before they were left out.

        Its errors add to what it shows, but they did so then; what is left out costs `left_out` by now.
        """
        more = float(self._light.beyond(seen)[self.order]) - self._usual[self.order]
        chance = self._light.chance_beyond(seen, self.order)
        if not self._leaving and more > self._doubt * chance + self._left_out:
            self._rise()

    def _judge(self, seen: Lighting, filtered: Lighting, time_s: float) -> None:
        """Think over how much of the orders is drawn and, where no effort leaves any out, which ones are needed."""
        self._light.take_in(filtered)
        if filtered.order == self.order:
            self._choose(seen, filtered, time_s)
        else:
            self._compare_with(filtered, filtered.order, 0.0)
        self._drawn.pass_to(self._light.weights(filtered, self._core if self._leaving else filtered.order))

    def _choose(self, seen: Lighting, filtered: Lighting, time_s: float) -> None:
        """Leave orders out when a lower one has sufficed for a while, by what the filter has made of the noise."""
        if len(seen.frequencies) == len(filtered.frequencies):
            self._usual = np.maximum(_KEPT * self._usual, self._light.beyond(seen))
        squared_error = self._light.squared_errors(filtered)
        least = float(squared_error.min())
        most = max((1.0 + self._tolerance) ** 2 * least, least + self._light.unseen) - self._left_out
        lowest = int(np.argmax(squared_error <= most)) if most >= least else self.order
        lowest = max(lowest, self._lowest)
        if lowest >= self.order:
            self._fits_since_s = math.inf
            if self.order == self.highest:
                self._doubt, self._rose = _STANDS_OUT, False
        elif not math.isfinite(self._fits_since_s):
            self._fits_since_s = time_s
        elif time_s - self._fits_since_s >= _LOWER_AFTER_S:
            self._left_out += float(squared_error[lowest]) - least
            self._doubt *= 2.0 if self._rose else 1.0
            self._fits_since_s, self._rose, self._leaving = math.inf, False, True
        if self._leaving or self.order == self.highest:
            # what suffices is known best
            self._compare_with(filtered, lowest, least)

    def _compare_with(self, filtered: Lighting, core: int, least: float) -> None:
        """Tell another light by the orders up to `core` and the squared error that this one is expected to have."""
        self._core, self._unsure = core, max(least, self._light.unseen)
        self._strength = self._lately = self._light.strength(filtered, core)
