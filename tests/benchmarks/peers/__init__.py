"""Other CPU volume renderers beside volref, on equal scenes in one run.

    python -m tests.benchmarks.peers                                   all of it: about ten minutes
    python -m tests.benchmarks.peers --problems blobs128 --renderers volref-march,scipy
    python -m tests.benchmarks.page                                    docs/performance.md from the figures

Needs the extra "bench" (VTK, Numba, Mitsuba with Dr.Jit); what is missing is named, and left out.  Besides,
on Debian: libgl1-mesa-dri and libegl1 for VTK's GPU caster on software GL, libllvm19 for Dr.Jit (what
it makes of minima, LLVM 15 and 16 cannot compile for processors without AVX-512).

One way through:

    problems ─► truth ─► renderers ─► measure ─► results (JSON) ─► summary ─► section, plot ─► the page
"""
