"""Sizes of files, functions and classes, and private imports; `python -m benchmarks.house` prints them."""

import ast

import pytest

from benchmarks.house import Rule, attributes, body_lines, modules, parameters, private_imports, rules

# What may be over a limit, and why.
EXCEPTED = {
    "parameters of a function": {
        "envs/_rendezvous.py:__init__": "the public arguments of an environment, each named and documented",
        "envs/render/panel.py:_write": "what a line of text looks like: place, size, colour, alignment",
        "train/_dagger.py:_collected": "what imitation is made of: teacher, learner, worlds and chance",
        "wifipgo/graph/optimise.py:optimise": "public: a graph, and options with defaults, by keyword",
        "wifipgo/graph/optimise.py:run": "the options of the command, which tyro reads from the signature",
        "wifipgo/graph/outliers/methods.py:solve_robust": "public: those of `solve`, and the method",
        "wifipgo/graph/posegraph.py:pose_graph": "public: the columns of a graph",
        "wifipgo/graph/solvers/planar.py:solve": "public: a graph, and options with defaults, by keyword",
        "wifipgo/radio/propagation/paths.py:trace_paths": "public: the kinds of paths, each with its switch",
        "wifipgo/radio/turn_profiles.py:listen": "joins channel, receiver and estimator, each configured",
    },
    "attributes of a class that is no configuration": {
        "benchmarks/_naive_env.py:NaiveEnv": "a yardstick for speed, written as such environments are",
        "benchmarks/real_csi.py:Row": "a row of a table: an attribute is a column",
        "envs/_rendezvous.py:RendezvousEnv": "PettingZoo and gymnasium ask for ten of them by name",
        "envs/_vector.py:RendezvousVectorEnv": "what adapters to frameworks ask for by name",
        "envs/render/scene.py:Scene": "what a picture shows, flat, so that it is a function of this alone",
        "train/torchrl_env.py:RendezvousTorchEnv": "TorchRL asks for six of them by name",
        "wifipgo/graph/solvers/_linearised.py:Squares": "arrays of one length that are sliced together",
        "wifipgo/graph/solvers/_problem.py:Problem": "a problem for solvers of both kinds",
        "wifipgo/radio/recordings/recorded_link.py:Link": "what a recording says of a link: a column each",
    },
}


@pytest.mark.parametrize("rule", rules(modules()), ids=lambda rule: rule.what)
def test_nothing_is_larger_than_it_may_be(rule: Rule) -> None:
    excepted = EXCEPTED.get(rule.what, {})
    assert not [size for size in rule.over() if size.where not in excepted]


def test_sizes_are_counted_right() -> None:
    code = '''
class Row(NamedTuple):
    """Two fields."""
    a: int
    b: int

class Thing:
    c: int
    def __init__(self, x, /, y=1, *rest, z, **more):
        """Not counted."""
        self.c, self.d = x, y

        self.d = (
            z
        )
'''
    row, thing = (node for node in ast.parse(code).body if isinstance(node, ast.ClassDef))
    function = next(node for node in ast.walk(thing) if isinstance(node, ast.FunctionDef))
    assert (attributes(row), attributes(thing)) == (2, 2)
    assert (parameters(function), body_lines(function)) == (3, 5)


def test_private_modules_are_found() -> None:
    code = "import envs._reward, envs\nfrom envs import _actions\nfrom envs._state import state_space\n"
    tree = ast.parse(code)
    assert len(list(private_imports("baselines/evaluate.py", tree))) == 3
    assert not list(private_imports("envs/_rendezvous.py", tree))
