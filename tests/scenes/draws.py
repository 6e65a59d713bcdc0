"""Values by what the program's tables say of their keys."""

import random
import re

AXES = "xyz"


def rounded(value):
    return float("%.6g" % value)


def as_table(part):
    return part if isinstance(part, dict) else {"type": part}


class Draws:
    """A wish decides what chance would: wishes = {"kinematics": "baqp", "keys": ("initial.from",)}."""

    def __init__(self, tables, seed, wishes=None):
        self.tables, self.random, self.seed, self.wishes = tables, random.Random(seed), seed, wishes or {}

    def maybe(self, share, key=""):
        """key: with its section, where a wish may ask for it."""
        return self.random.random() < share or self.wishes_key(key)

    def wishes_key(self, key):
        return key in self.wishes.get("keys", ())

    def wish(self, what, otherwise):
        """What is wished for, or what chance says: a function that is called either way, so that other draws stay as they are."""
        drawn = otherwise()
        return self.wishes.get(what, drawn)

    def between(self, low, high):
        return self.random.uniform(low, high)

    def scale(self, low, high):
        """10 to a power between low and high."""
        return 10 ** self.between(low, high)

    def allowed_value(self, key):
        """A value that the table allows; None for texts of which the table does not say enough."""
        text, r = key.allowed, self.random
        if text == "true or false":
            return self.maybe(0.5)
        if text.startswith("the name of a"):
            return self.part(re.match(r"the name of an? (\w+)", text).group(1))
        if re.match(r'(a list of )?"', text):
            choices = self.choices(key)
            return r.sample(choices, r.randint(1, len(choices))) if text.startswith("a list") else r.choice(choices)
        if not re.match(r"an? (integer|number)", text):
            return None
        whole = text.startswith("an integer")
        bounds = {sign: float(number) for sign, number in re.findall(r"(>=|<=|>|<) (-?[\d.e+-]+)", text)}
        low = bounds.get(">=", bounds.get(">"))
        high = bounds.get("<=", bounds.get("<"))
        default = float(key.default) if re.match(r"-?[\d.]+(e-?\d+)?$", key.default) else None
        if whole:
            low = int(low) if low is not None else 0
            return r.randint(low, min(int(high), low + 3) if high is not None else low + 3)
        value = default * self.between(0.5, 2) if default else self.between(0.2, 2)
        if low is not None and high is not None and not low < value < high:
            value = self.between(low + 0.1 * (high - low), high - 0.1 * (high - low))
        if low is not None:
            value = max(value, low + 1e-3)
        return rounded(value)

    def choices(self, key):
        """The words that a key may be, those apart that depend on the laws of the scene."""
        return [word for word in re.findall(r'"([^"]*)"', key.allowed) if not word.endswith(":NAME")]

    def filled(self, table, hints, share=0.3, leave=(), section=""):
        """A section: required keys, others with this probability, as many of each group as it asks for."""
        taken = {}
        grouped = set()
        for how, count, names in table.groups:
            grouped.update(names)
            usable = [name for name in names if name not in leave and (name in hints or self.has_value(table.keys[name]))]
            wished = [name for name in usable if self.wishes_key("%s.%s" % (section, name))]
            if any(name in taken for name in names) or (how == "at most" and not self.maybe(share) and not wished):
                continue
            others = [name for name in self.random.sample(usable, len(usable)) if name not in wished]
            for name in (wished + others)[:count]:
                taken[name] = None
        for name, key in table.keys.items():
            if name in leave or (name in grouped and name not in taken):
                continue
            if name in taken or key.required or self.maybe(share, "%s.%s" % (section, name)):
                hint = hints.get(name, lambda: self.allowed_value(key))
                value = hint() if callable(hint) else hint
                if value is not None:
                    taken[name] = value
        return {name: taken[name] for name in table.keys if taken.get(name) is not None}

    def has_value(self, key):
        return self.allowed_value(key) is not None

    def part(self, kind, name=None, among=None, leave=()):
        """A part with keys: its name alone, or a table."""
        names = [part for part in self.tables.parts[kind] if among is None or part in among]
        drawn = self.random.choice(names)
        name = name or self.wishes.get(kind if kind in ("material", "influence", "stabilization") and self.wishes.get(kind) in names else "", drawn)
        hints = getattr(self, "hints_of_" + kind, lambda part: {})(name)
        keys = self.filled(self.tables.parts[kind][name], hints, 0.3, leave, kind)
        return {"type": name, **keys} if keys or self.maybe(0.2) else name
