#include "demslam/features/built_in_model.h"

// The file's bytes, taken in by the assembler.
asm(R"(
    .pushsection .rodata
    .balign 16
    .hidden demslam_lunar_begin
    .hidden demslam_lunar_end
    .global demslam_lunar_begin
    .global demslam_lunar_end
demslam_lunar_begin:
    .incbin ")" DEMSLAM_LUNAR_GRAPH R"("
demslam_lunar_end:
    .byte 0
    .popsection
)");

extern "C" const char demslam_lunar_begin, demslam_lunar_end;

namespace demslam {

std::string_view lunar_graph() { return {&demslam_lunar_begin, &demslam_lunar_end}; }

}  // namespace demslam
