#include "demslam/report/internal/embedded_page.h"

#ifdef DEMSLAM_PAGE_FILE
// The assembler takes the file in as it is: no compiler has to read a megabyte of numbers.
asm(".section .rodata\n"
    "demslam_page_begin: .incbin \"" DEMSLAM_PAGE_FILE
    "\"\n"
    "demslam_page_end: .byte 0\n"
    ".previous\n");

extern "C" const char demslam_page_begin[], demslam_page_end[];

std::string_view demslam::embedded_page() { return {demslam_page_begin, demslam_page_end}; }
#else
std::string_view demslam::embedded_page() { return {}; }
#endif
