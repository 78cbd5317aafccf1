"""Compile functions to objects that need neither Numba nor Python to run.

Numba infers types and writes LLVM's code; all that an entry calls is linked and optimized once, for
an instruction set instead of one processor. The object defines `ENTRY`, which reads its arguments
from a table of 8-byte numbers, and needs the symbols in `SYMBOLS` only, of the C library.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from llvmlite import binding, ir
from numba import njit, typeof, types
from numba.core import config
from numba.core.codegen import AOTCodeLibrary, AOTCPUCodegen
from numba.core.compiler import Compiler
from numba.core.typing.templates import make_intrinsic_template

from flexband.compilation.targets import ENTRY, instruction_set, target_machine

SYMBOLS = {"malloc", "free", "memcpy", "memmove", "memset", "sqrt", "floor", "rint", "pow"} | {
    "sin", "cos", "sincos", "exp", "atan2", "hypot"
}  # fmt: skip
"""What objects may need of the C library."""

USES_SVML = vars(config)["USING_SVML"]
"""Whether Intel's library of vector functions is loaded."""


class _Library(AOTCodeLibrary):
    """The code of one function, which is optimized where it is linked."""

    def _optimize_functions(self, ll_module: binding.ModuleRef) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._finalized = True

    def link(self, module: binding.ModuleRef) -> binding.ModuleRef:
        """Add the code of this function, and of all that it calls, to a module, and return it."""
        libraries = {}
        others = {}
        waiting: list = [self]
        while waiting:
            library = waiting.pop()
            if library.codegen is not self.codegen:
                others[library] = None
            elif library not in libraries:
                libraries[library] = None
                waiting += library._linking_libraries
        for library in libraries:
            module.link_in(library._final_module, preserve=True)
        for library in others:  # compiled in Numba's usual way, with all that they call
            module.link_in(library._get_module_for_linking(), preserve=True)
        return module

    def _get_module_for_linking(self) -> binding.ModuleRef:
        """Return the linked code for a function that Numba compiles in its usual way."""
        if self._shared_module is None:
            module = self._codegen._create_empty_module(self.name)
            self._shared_module = self.link(binding.parse_assembly(str(module)))
            for function in self._shared_module.functions:
                if not function.is_declaration:
                    function.linkage = binding.Linkage.linkonce_odr
        return self._shared_module

    def get_pointer_to_function(self, name: str) -> int:
        """Return that there is no machine code yet."""
        return 0


class _Codegen(AOTCPUCodegen):
    """What makes libraries of this kind."""

    _library_class = _Library

    def _customize_tm_options(self, options: dict) -> None:
        super()._customize_tm_options(options)
        options["cpu"], options["features"] = instruction_set()

    def set_env(self, *_: object) -> None:
        """Set nothing: compiled functions use no objects of Python."""


@cache
def _context(targetctx: Any) -> Any:
    return targetctx.subtarget(_internal_codegen=_Codegen("flexband"))


class _Compiler(Compiler):
    """Numba's compiler, for libraries of this kind."""

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *options: Any) -> None:
        targetctx.refresh()
        super().__init__(typingctx, _context(targetctx), library, *options)


def dispatcher(function: Callable, options: dict[str, Any]) -> Any:
    """Return Numba's dispatcher of a function that only compiled code calls."""
    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
        raise RuntimeError("machine code cannot be made while NUMBA_DISABLE_JIT is set")
    defaults = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    made: Any = njit(pipeline_class=_Compiler, **(defaults | options))(function)
    find = made.get_call_template
    made.get_call_template = lambda args, kws: find(
        tuple(map(types.unliteral, args)), {name: types.unliteral(kws[name]) for name in kws}
    )
    return made


def instruction_type(handle: object, function: Callable, *, constants: bool) -> types.Function:
    """Return Numba's type of a function that writes LLVM's code, which is known by a handle."""
    return types.Function(
        make_intrinsic_template(handle, function, function.__name__, prefer_literal=constants)
    )


def object_code(dispatcher: Any, arguments: tuple) -> bytes:
    """Return the object of the function of a dispatcher, for arguments like these.

    Raises
    ------
    TypeError
        if the function returns something, or needs more than the C library.
    """
    kinds = tuple(map(typeof, arguments))
    dispatcher.compile(kinds)
    result = dispatcher.overloads[kinds]
    name = dispatcher.py_func.__qualname__
    if result.signature.return_type != types.none:
        raise TypeError(f"{name} returns {result.signature.return_type}; entries return nothing")
    module = binding.parse_assembly(str(_entry(result)))
    module.data_layout = result.library._codegen._data_layout
    result.library.link(module)
    for symbol in (*module.functions, *module.global_variables):
        if not symbol.is_declaration and symbol.name != ENTRY:
            symbol.linkage = binding.Linkage.internal
    machine = target_machine()
    options = binding.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = True
    builder = binding.create_pass_builder(machine, options)
    passes = builder.getModulePassManager()
    passes.add_refprune_pass()
    passes.run(module, builder)
    external_symbols = {
        symbol.name
        for symbol in (*module.functions, *module.global_variables)
        if symbol.is_declaration or symbol.name.startswith("numba.dynamic.globals")
    }
    if missing := sorted(
        s for s in external_symbols - SYMBOLS if not s.startswith(("llvm.", "__svml_"))
    ):
        raise TypeError(f"{name} needs {', '.join(missing)}, which are not of the C library")
    return machine.emit_object(module)


def _entry(result: Any) -> ir.Module:
    """Return a module of `ENTRY`, which reads the arguments of a function from a table."""
    context = result.target_context
    description = result.fndesc
    number = ir.IntType(64)
    module = ir.Module(ENTRY)
    module.triple = binding.get_process_triple()
    kind = context.call_conv.get_function_type(description.restype, description.argtypes)
    function = ir.Function(module, kind, description.llvm_func_name)
    entry = ir.Function(module, ir.FunctionType(ir.IntType(32), [number.as_pointer()]), ENTRY)
    builder = ir.IRBuilder(entry.append_basic_block())
    arguments: list = [builder.alloca(pointer.pointee) for pointer in kind.args[:2]]
    for place, argument in enumerate(kind.args[2:]):
        address = builder.gep(entry.args[0], [number(place)])
        arguments.append(builder.load(builder.bitcast(address, argument.as_pointer())))
    builder.ret(builder.call(function, arguments))
    _add_memory(module)
    return module


def _add_memory(module: ir.Module) -> None:
    """Add what Numba's code calls for the memory of arrays, here on top of malloc and free.

    An array begins with its count of references, a destructor and its argument, the address of its
    numbers, their size, and an allocator, of which only the count and the address are used.
    """
    number = ir.IntType(64)
    pointer = ir.IntType(8).as_pointer()
    malloc = ir.Function(module, ir.FunctionType(pointer, [number]), "malloc")
    free = ir.Function(module, ir.FunctionType(ir.VoidType(), [pointer]), "free")
    # Allocate the array behind its header, at an address with the alignment.
    kind = ir.FunctionType(pointer, [number, ir.IntType(32)])
    new = ir.Function(module, kind, "NRT_MemInfo_alloc_aligned")
    builder = ir.IRBuilder(new.append_basic_block())
    size = new.args[0]
    alignment = builder.zext(new.args[1], number)
    header = 48
    memory = builder.call(malloc, [builder.add(size, builder.add(alignment, number(header)))])
    with builder.if_then(builder.icmp_unsigned("!=", memory, pointer(None))):
        address = builder.add(builder.ptrtoint(memory, number), number(header - 1))
        address = builder.and_(builder.add(address, alignment), builder.neg(alignment))
        fields = builder.bitcast(memory, number.as_pointer())
        for place, value in enumerate((number(1), number(0), number(0), address, size, number(0))):
            builder.store(value, builder.gep(fields, [number(place)]))
    builder.ret(memory)
    # The other functions call this one, or what the C library has.
    any_alignment = ir.Function(module, malloc.function_type, "NRT_MemInfo_alloc")
    builder = ir.IRBuilder(any_alignment.append_basic_block())
    builder.ret(builder.call(new, [any_alignment.args[0], ir.Constant(ir.IntType(32), 16)]))
    for name in ("NRT_MemInfo_call_dtor", "NRT_Free"):
        end = ir.Function(module, free.function_type, name)
        builder = ir.IRBuilder(end.append_basic_block())
        builder.call(free, end.args)
        builder.ret_void()
    plain = ir.Function(module, malloc.function_type, "NRT_Allocate")
    builder = ir.IRBuilder(plain.append_basic_block())
    builder.ret(builder.call(malloc, plain.args))
