#pragma once

// Wider registers where the processor has them. Multiplications and additions are not fused and
// sums keep their order, so the result is the same without.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define UNFLEX_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define UNFLEX_WIDE
#endif
