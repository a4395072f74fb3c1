"""probebox_master as a module, where there is no LinuxCNC."""
import importlib.machinery
import importlib.util
import os
import sys
import types


def component(kit):
    sys.modules["hal"] = types.ModuleType("hal")
    loader = importlib.machinery.SourceFileLoader("probebox_master", os.path.join(kit, "probebox_master"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("probebox_master", loader))
    loader.exec_module(module)
    return module
