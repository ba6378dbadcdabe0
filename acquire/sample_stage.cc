#include "acquire/sample_stage.h"

#include "core/error.h"

namespace nacre::acquire {

const char* Name(Target target) {
  switch (target) {
    case Target::kNothing:
      return "nothing";
    case Target::kCheckerboard:
      return "checkerboard";
    case Target::kFlat:
      return "flat";
    case Target::kReference:
      return "reference";
    case Target::kGlare:
      return "glare";
    case Target::kAmbient:
      return "ambient";
    case Target::kSample:
      return "sample";
  }
  throw LogicError("a target of no kind");
}

}  // namespace nacre::acquire
