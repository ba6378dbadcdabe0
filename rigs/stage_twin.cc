#include "rigs/stage_twin.h"

#include "core/error.h"

#include <utility>

namespace nacre::rigs {

StageTwin::StageTwin(std::shared_ptr<World> world) : world_(std::move(world)) {}

void StageTwin::Place(acquire::Target target, int pose) {
  Expect(pose >= 0, "a pose of 0 or more");
  world_->target = target;
  world_->pose = pose;
  ++world_->revision;
}

}  // namespace nacre::rigs
