#pragma once

/// Compiles a function for several instruction sets and picks one at start-up; for files without Eigen only, whose
/// alignment must not change with the instruction set. Floating-point contraction is off in this build, so every clone
/// that keeps the order of its sums gives the same bits. Sanitizers run before the pickers may, hence plain functions
/// there.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__x86_64__)
#define DEMSLAM_VECTOR_CLONES
#else
#define DEMSLAM_VECTOR_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#endif
