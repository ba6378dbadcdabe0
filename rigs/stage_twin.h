#pragma once

#include "acquire/sample_stage.h"
#include "rigs/world.h"

#include <memory>

namespace nacre::rigs {

/// A stage that puts each target in place by itself, at once.
class StageTwin final : public acquire::SampleStage {
 public:
  explicit StageTwin(std::shared_ptr<World> world);
  void Place(acquire::Target target, int pose) override;

 private:
  std::shared_ptr<World> world_;
};

}  // namespace nacre::rigs
