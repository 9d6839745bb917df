#include "demslam/features/built_in_model.h"

/// The bytes of a file between two symbols, taken in by the assembler.
#define DEMSLAM_EMBED(name, file)                             \
  asm(".pushsection .rodata\n.balign 16\n"                    \
      ".hidden demslam_" name "_begin\n.hidden demslam_" name \
      "_end\n"                                                \
      ".global demslam_" name "_begin\n.global demslam_" name \
      "_end\n"                                                \
      "demslam_" name "_begin:\n.incbin \"" file "\"\ndemslam_" name "_end:\n.byte 0\n.popsection\n")

DEMSLAM_EMBED("lunar", DEMSLAM_WEIGHTS "/lunar.onnx");
DEMSLAM_EMBED("lunar_matcher", DEMSLAM_WEIGHTS "/lunar_matcher.onnx");

extern "C" const char demslam_lunar_begin, demslam_lunar_end, demslam_lunar_matcher_begin, demslam_lunar_matcher_end;

namespace demslam {

const std::vector<BuiltInModel>& built_in_models() {
  /// `lunar` is modest about ground it was not trained on: with XFeat's threshold it found a third of the points that
  /// sand has, and those it had left out match as well.
  constexpr double kLunarMinProbability = 0.01;  // as in the card that training/export.py writes
  static const std::vector<BuiltInModel> all{
      {"lunar", "xfeat", {&demslam_lunar_begin, &demslam_lunar_end}, kLunarMinProbability},
      {"lunar-matcher", "lightglue", {&demslam_lunar_matcher_begin, &demslam_lunar_matcher_end}}};
  return all;
}

}  // namespace demslam
