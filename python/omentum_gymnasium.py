"""Gymnasium knows the environments of omentum without an import of omentum: `gymnasium.make("omentum/Retract-v0")`.

An installed package has the file omentum_gymnasium.pth, which Python reads at its start: it calls watch(), and when
Gymnasium is imported, the names are registered. That loads nothing of omentum: make() does, by the entry points. Up to
version 0.29 Gymnasium calls register() itself, by the entry point `gymnasium.envs` of the package; later ones have no
such thing.
"""
import importlib.abc
import importlib.util
import sys

TASKS = ("approach", "cart-pole", "expose", "press", "reach", "retract")  # a test compares them with omentum.rl_tasks()
_MODULE = "gymnasium.envs.registration"


def register():
    """Register the names that Gymnasium does not have yet."""
    registration = sys.modules[_MODULE]
    for task in TASKS:
        name = f"omentum/{''.join(part.capitalize() for part in task.split('-'))}-v0"
        if name not in registration.registry:
            registration.register(name, entry_point="omentum.gym:Env", vector_entry_point="omentum.gym:make_vector_env", kwargs={"task": task})


class _Finder(importlib.abc.MetaPathFinder):
    """Finds one module as all others do, and registers when it has been executed."""

    def find_spec(self, name, path=None, target=None):
        if name != _MODULE:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def exec_module(module):
                execute(module)
                register()

            spec.loader.exec_module = exec_module
        return spec


def watch():
    """Register when Gymnasium is imported, or at once where it is."""
    if _MODULE in sys.modules:
        register()
    elif not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
