"""Descriptions of the states of `capsule.survey.cycle` for the user."""

STATE_WORDS = {
    "starting": "waits until it feels the wave",
    "exploring": "explores",
    "finishing": "passes the suspected place",
    "folding": "folds",
    "returning": "is folded; the waves push it back",
    "unfolding": "unfolds",
    "finding": "finds its position",
    "passing": "passes the place again",
    "approaching": "travels to its target",
    "arrived": "has reached its target",
    "closing": "unfolds at the end",
    "ended": "the survey is over",
}
