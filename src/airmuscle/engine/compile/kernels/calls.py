"""Calls of compiled functions by address from kernels, and the decorators of the parts of kernels.

numba copies a part into the kernel that calls it, which so remains one function, whose machine code
can be stored.
"""

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj


@intrinsic
def invoke(typing_context, address, arguments):
    """Call the function at `address`, which returns nothing, with addresses and floats."""
    signature = types.void(types.intp, arguments)

    def generate(context, builder, sig, values):
        items = [builder.extract_value(values[1], i) for i in range(len(arguments))]
        kind = ir.FunctionType(ir.VoidType(), [item.type for item in items])
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), items)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def pointer(typing_context, array):
    """The address of an array's first element."""
    signature = types.intp(array)

    def generate(context, builder, sig, values):
        data = context.make_array(sig.args[0])(context, builder, values[0]).data
        return builder.ptrtoint(data, ir.IntType(64))

    return signature, generate


@intrinsic
def as_vector(typing_context, table):
    """The numbers of a C-contiguous table as one vector that shares its memory."""
    vector = types.Array(table.dtype, 1, "C")

    def generate(context, builder, sig, values):
        source = context.make_array(sig.args[0])(context, builder, values[0])
        flat = context.make_array(vector)(context, builder)
        shape, strides = (
            cgutils.pack_array(builder, [number]) for number in (source.nitems, source.itemsize)
        )
        arrayobj.populate_array(flat, source.data, shape, strides, source.itemsize, source.meminfo)
        return arrayobj.impl_ret_borrowed(context, builder, vector, flat._getvalue())

    return vector(table), generate


@intrinsic
def call_kernel(typing_context, address, slots):
    """Call the entry point of a compiled kernel at `address` with the address of its slots; its
    status.
    """
    signature = types.int64(types.intp, types.intp)

    def generate(context, builder, sig, values):
        word = ir.IntType(64)
        return builder.call(
            builder.inttoptr(values[0], ir.FunctionType(word, [word]).as_pointer()), [values[1]]
        )

    return signature, generate


PART = numba.njit(error_model="numpy", nogil=True, inline="always")
"""Decorator of a part of a kernel, with floating-point operations in the order in which they are
written.
"""

CONTRACTED_PART = numba.njit(
    error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True, inline="always"
)
"""Decorator of a part whose sums may be reordered and whose products and sums may be fused."""
