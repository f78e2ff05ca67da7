"""Input files of Swage: what their groups say, and copies in which some keys say something else.
Standard library only."""
import re

TOKEN = re.compile(r"""
    (?P<comment>![^\n]*) | (?P<text>'(?:[^']|'')*'|"(?:[^"]|"")*") | &(?P<group>\w+) |
    (?P<end>/) | (?P<key>[A-Za-z_]\w*)\s*(?:\([^)]*\)\s*)?=(?!=) | (?P<word>[^\s,/!&'"=]+)""", re.X)


class Group:
    """One `&kind ... /`: `values[key]` is the list of its words, `place[key]` where key and values
    stand in the text, `start` and `end` where the group does."""

    def __init__(self, kind, start):
        self.kind, self.start, self.end = kind, start, start
        self.values, self.place = {}, {}

    def get(self, key, default=None):
        """The first value of a key."""
        return (self.values.get(key) or [default])[0]


def read_groups(text):
    """The groups of a namelist file, in their order; faults are the solver's to tell."""
    found, group, key = [], None, None
    for token in TOKEN.finditer(text):
        if token['group']:
            group, key = Group(token['group'].lower(), token.start()), None
        elif group is None or token['comment']:
            continue
        elif token['end']:
            group.end = token.end()
            found.append(group)
            group = None
        elif token['key']:
            key = token['key'].lower()
            group.values.setdefault(key, [])
            group.place[key] = (token.start(), token.end())
        elif key and (token['text'] or token['word']):
            group.values[key].append(token['text'][1:-1] if token['text'] else token['word'])
            group.place[key] = (group.place[key][0], token.end())
    return found


def changed(text, changes):
    """The text with other keys in some of its groups: `changes` is a list of (group, {key: value}),
    a value as it is written, None to leave the key out; None in place of the keys leaves out the
    group."""
    edits = []
    for group, keys in changes:
        if keys is None:
            edits.append((group.start, group.end, ''))
            continue
        added = ''
        for key, value in keys.items():
            if key in group.place:
                edits.append((*group.place[key], '' if value is None else f'{key} = {value}'))
            elif value is not None:
                added += f'{key} = {value} '
        edits.append((group.end - 1, group.end - 1, ' ' + added if added else ''))
    for start, end, words in sorted(edits, reverse=True):
        text = text[:start] + words + text[end:]
    return text
