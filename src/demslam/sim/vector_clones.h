#pragma once

/// Marks a kernel that is compiled for several instruction sets and chosen at run time. Only for functions whose file
/// includes no Eigen (docs/architecture.md, "Eigen's ABI"). Sanitizers and clang take the plain form.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define DEMSLAM_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define DEMSLAM_VECTOR_CLONES
#endif
