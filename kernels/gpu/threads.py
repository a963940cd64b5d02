"""Operations of the threads of a block: barriers, shared memory seen as arrays, maxima.

In GPU kernels one block of threads carries one chain, one thread per link. Unless a comment says otherwise all threads
of a block take the same branches, because all of them must reach every barrier.

The native snippets below are what pure Warp lacks. Their CPU branches run in blocks of fibers
(``wp.config.enable_cpu_blocks``), in which GPU kernels are tested without a GPU.
"""

import functools
from typing import Any

import warp as wp

from warpchain.kernels.types import Integers


@wp.func_native("WP_TILE_SYNC();")
def barrier():
    """Waits until all threads of the block are here; then all see what each wrote before."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __syncthreads_count(x);
#else
    int& seen = flags.data[slot];
    seen += x;
    WP_TILE_SYNC();
    const int count = seen;
    WP_TILE_SYNC();
    seen = 0;
    WP_TILE_SYNC();
    return count;
#endif
""")
def barrier_count(flags: Integers, slot: int, x: bool) -> int:
    """A barrier that counts the threads with a true x, in one instruction; fibers use ``flags[slot]``, otherwise 0."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __reduce_max_sync(0xffffffffu, x);
#else
    return x;
#endif
""")
def warp_greatest(x: wp.int32) -> wp.int32:
    """Greatest x in a hardware warp, one instruction (compute capability ≥ 8.0); ``wp.tile_max`` has four barriers."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return 32;
#else
    return 1;
#endif
""")
def warp_width() -> int:
    """Number of threads in a hardware warp; 1 for fibers."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    unsigned long long now;
    asm volatile("mov.u64 %0, %globaltimer;" : "=l"(now));
    return 1e-9 * now;
#else
    return 1e-9 * __builtin_readcyclecounter();
#endif
""")
def clock() -> wp.float64:
    """Time [s] to a fraction of a microsecond; without a GPU in 10⁹ cycles of the processor."""


@functools.cache
def tile_address(dtype: type, size: int):
    """Warp function ``address(tile)`` of the shared memory behind a tile (size,) of this type.

    As an array, a tile can be written by many threads without a barrier after each element, and by atomics.
    """

    @wp.func_native("return reinterpret_cast<::wp::uint64>(tile.data.ptr);")
    def address(tile: wp.tile[dtype, size]) -> wp.uint64: ...

    return address


WRITE_PAIR = """
#if defined(__CUDA_ARCH__)
    reinterpret_cast<REAL2*>(memory)[index] = make_REAL2(x, y);
#else
    reinterpret_cast<REAL*>(memory)[2 * index] = x;
    reinterpret_cast<REAL*>(memory)[2 * index + 1] = y;
#endif
"""
READ_PAIR = """
#if defined(__CUDA_ARCH__)
    const REAL2 pair = reinterpret_cast<const REAL2*>(memory)[index];
    return {pair.x, pair.y};
#else
    return {reinterpret_cast<const REAL*>(memory)[2 * index], reinterpret_cast<const REAL*>(memory)[2 * index + 1]};
#endif
"""


@functools.cache
def number_memory(real: Any):
    """Warp functions (write a pair, read a pair, write a number, read a number) of numbers of one type.

    ``write_pair(memory, index, x, y)``, ``read_pair(memory, index)`` → (x, y), and so on: memory is an address, a
    multiple of the size of a pair, and the index counts pairs or numbers.
    """
    name = "float" if real is wp.float32 else "double"
    vec2 = wp.types.vector(length=2, dtype=real)
    write_two, read_two = (snippet.replace("REAL", name) for snippet in (WRITE_PAIR, READ_PAIR))

    @wp.func_native(write_two)
    def write_pair(memory: wp.uint64, index: int, x: real, y: real): ...

    @wp.func_native(read_two)
    def read_pair(memory: wp.uint64, index: int) -> vec2: ...

    @wp.func_native(f"reinterpret_cast<{name}*>(memory)[index] = x;")
    def write_one(memory: wp.uint64, index: int, x: real): ...

    @wp.func_native(f"return reinterpret_cast<const {name}*>(memory)[index];")
    def read_one(memory: wp.uint64, index: int) -> real: ...

    return write_pair, read_pair, write_one, read_one


@wp.func_native("return reinterpret_cast<::wp::uint64>(reinterpret_cast<char*>(memory) + offset);")
def address_at(memory: wp.uint64, offset: int) -> wp.uint64:
    """An address so many bytes further; by a sum of integers the compiler would lose that it is shared memory."""


vec4i = wp.types.vector(length=4, dtype=wp.int32)


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    reinterpret_cast<int4*>(memory)[index] = make_int4(value[0], value[1], value[2], value[3]);
#else
    reinterpret_cast<::wp::vec_t<4, ::wp::int32>*>(memory)[index] = value;
#endif
""")
def write_four(memory: wp.uint64, index: int, value: vec4i):
    """Writes four integers at an index into memory whose address is a multiple of 16."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    const int4 value = reinterpret_cast<const int4*>(memory)[index];
    return ::wp::vec_t<4, ::wp::int32>(value.x, value.y, value.z, value.w);
#else
    return reinterpret_cast<const ::wp::vec_t<4, ::wp::int32>*>(memory)[index];
#endif
""")
def read_four(memory: wp.uint64, index: int) -> vec4i:
    """Reads four integers that :func:`write_four` wrote."""


@functools.cache
def block_maxima(block_dim: int):
    """Warp functions for maxima over the threads of a block.

    ``greatest(tile, lane, value)`` → the greatest value; ``write_maxima(memory, lane, values)``, then a barrier of the
    caller, then ``read_maxima(memory)`` → the greatest of each of four values. Both may be used again after a barrier.
    """

    @wp.func
    def greatest(tile: wp.tile[wp.int32, block_dim], lane: int, value: wp.int32):
        tile[lane // warp_width()] = warp_greatest(value)
        top = tile[0]
        for i in range(1, wp.static(block_dim) // warp_width()):
            top = wp.max(top, tile[i])
        return top

    @wp.func
    def write_maxima(memory: wp.uint64, lane: int, values: vec4i):
        of_warp = vec4i()
        for k in range(4):
            of_warp[k] = warp_greatest(values[k])
        write_four(memory, lane // warp_width(), of_warp)

    @wp.func
    def read_maxima(memory: wp.uint64):
        top = read_four(memory, 0)
        for i in range(1, wp.static(block_dim) // warp_width()):
            top = wp.max(top, read_four(memory, i))
        return top

    return greatest, write_maxima, read_maxima
