// The photons' inner loop, compiled once for each instruction set. A pass through the
// loop takes every lane to its next event: a collision (absorption, scattering, or null
// where media differ) or a face (reflection, refraction, exit). What happens once a
// photon is the Roster's.
// clang-format off: the order matters
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rigs/transport/monte_carlo/internal/packet_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include "core/error.h"
#include "rigs/transport/monte_carlo/internal/lane_math-inl.h"
#include "rigs/transport/monte_carlo/internal/packet.h"
#include "rigs/transport/monte_carlo/internal/photon_state-inl.h"
#include "rigs/transport/monte_carlo/threefry.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fmt/format.h>
#include <string>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace nacre::rigs::monte_carlo::internal {
namespace HWY_NAMESPACE {

// The loop's constants and methods for one kind of volume.
template <Structure kStructure, bool kBox, bool kIsotropic>
class Loop {
 public:
  HWY_ATTR Loop(const PacketJob& job, std::uint32_t photon_high)
      : volume_(job.packet_volume), photon_high_(photon_high) {
    key_ = {static_cast<std::uint32_t>(job.seed),
            static_cast<std::uint32_t>(job.seed >> 32),
            0,
            0,
            0};
    key_[4] = kThreefryParity ^ key_[0] ^ key_[1];
  }

  HWY_ATTR void Run(Roster& roster) const {
    const Words32 du;
    const U alive = hn::Set(du, static_cast<std::uint32_t>(Fate::kAlive));
    State s = LoadState(roster);
    while (!roster.Empty()) {
      Step(s);
      const auto ended = hn::And(hn::VecFromMask(du, hn::Ne(s.fate, alive)), s.active);
      const Mask ended_lanes = hn::MaskFromVec(hn::BitCast(Floats(), ended));
      if (!hn::AllFalse(Floats(), ended_lanes)) {
        ReplaceEnded(ended_lanes, roster, s);
      }
    }
  }

 private:
  HWY_INLINE HWY_ATTR void Step(State& s) const {
    const Floats d;
    const FourWords words = Draw(s.photon, photon_high_, s.step, key_);
    s.step = hn::Add(s.step, hn::Set(Words32(), 1));
    F free_path = Set(volume_.free_path_mm);
    F top = hn::Zero(d);
    F bottom = Set(volume_.depth_mm);
    if constexpr (kStructure == Structure::kLayers) {
      free_path = GatherFloat(volume_.layer_free_path_mm, s.part);
      top = GatherFloat(volume_.layer_top_mm, s.part);
      bottom = GatherFloat(volume_.layer_bottom_mm, s.part);
    }
    const F flight = hn::Mul(MinusLog(UnitPositive(words.a)), free_path);
    const State before = s;
    s.x = hn::Add(s.x, hn::Mul(flight, s.ux));
    s.y = hn::Add(s.y, hn::Mul(flight, s.uy));
    s.z = hn::Add(s.z, hn::Mul(flight, s.uz));
    Mask outside = hn::Or(hn::Lt(s.z, top), hn::Gt(s.z, bottom));
    if constexpr (kBox) {
      outside = hn::Or(outside,
                       hn::Or(hn::Gt(hn::Abs(s.x), Set(volume_.half_x_mm)),
                              hn::Gt(hn::Abs(s.y), Set(volume_.half_y_mm))));
    }
    Collide(words, hn::Not(outside), s);
    if (!hn::AllFalse(d, outside)) {
      MeetFace({before, words, outside, top, bottom}, s);
    }
  }

  HWY_INLINE HWY_ATTR I MediumAt(const State& s) const {
    const Floats d;
    const Ints di;
    if constexpr (kStructure == Structure::kPattern) {
      const I cx =
          hn::ConvertTo(di, hn::Floor(hn::Mul(s.x, Set(volume_.cells_per_mm_x))));
      const I cy =
          hn::ConvertTo(di, hn::Floor(hn::Mul(s.y, Set(volume_.cells_per_mm_y))));
      return hn::And(hn::Xor(cx, cy), hn::Set(di, 1));
    } else if constexpr (kStructure == Structure::kVoxels) {
      const I ix = Cell(hn::Sub(s.x, Set(volume_.voxel_left_mm)), 0);
      const I iy = Cell(hn::Sub(s.y, Set(volume_.voxel_lower_mm)), 1);
      const I iz = Cell(s.z, 2);
      const I row = hn::Add(iy, hn::Mul(iz, hn::Set(di, volume_.voxel_count[1])));
      const I index = hn::Add(ix, hn::Mul(row, hn::Set(di, volume_.voxel_count[0])));
      // Two bytes a voxel, read by pairs.
      const auto* base = reinterpret_cast<const std::int32_t*>(  // NOLINT
          volume_.voxel_medium.data());
      const I pair = hn::GatherOffset(di, base, hn::Add(index, index));
      return hn::And(pair, hn::Set(di, 0xFFFF));
    } else {
      (void)d;
      return s.part;
    }
  }

  HWY_INLINE HWY_ATTR I Cell(F from_corner_mm, std::size_t axis) const {
    const Ints di;
    const F last = Set(static_cast<float>(volume_.voxel_count[axis] - 1));
    const F cell = hn::Mul(from_corner_mm, Set(volume_.voxels_per_mm[axis]));
    return hn::ConvertTo(di, hn::Min(hn::Max(cell, hn::Zero(Floats())), last));
  }

  // Absorption, scattering or nothing, in the lanes of `inside`.
  HWY_INLINE HWY_ATTR void Collide(const FourWords& words,
                                   Mask inside,
                                   State& s) const {
    const Words32 du;
    const auto inside_words = hn::RebindMask(du, inside);
    const I medium = MediumAt(s);
    U absorb_below = hn::Set(du, volume_.absorb_below[0]);
    F g = Set(volume_.g[0]);
    auto scatters = inside_words;
    if constexpr (kStructure == Structure::kPattern) {
      const auto second = hn::RebindMask(du, hn::Ne(medium, hn::Zero(Ints())));
      const U last = hn::IfThenElse(second,
                                    hn::Set(du, volume_.collide_last[1]),
                                    hn::Set(du, volume_.collide_last[0]));
      absorb_below =
          hn::IfThenElse(second, hn::Set(du, volume_.absorb_below[1]), absorb_below);
      g = hn::IfThenElse(hn::RebindMask(Floats(), second), Set(volume_.g[1]), g);
      scatters = hn::AndNot(hn::Gt(words.b, last), scatters);
    } else if constexpr (kStructure == Structure::kVoxels) {
      absorb_below = GatherWord(volume_.absorb_below, medium);
      g = GatherFloat(volume_.g, medium);
      scatters = hn::AndNot(hn::Gt(words.b, GatherWord(volume_.collide_last, medium)),
                            scatters);
    } else if constexpr (kStructure == Structure::kLayers) {
      absorb_below = GatherWord(volume_.absorb_below, medium);
      g = GatherFloat(volume_.g, medium);
    }
    const auto absorbed = hn::And(inside_words, hn::Lt(words.b, absorb_below));
    s.fate = hn::IfThenElse(
        absorbed, hn::Set(du, static_cast<std::uint32_t>(Fate::kAbsorbed)), s.fate);
    if constexpr (kStructure == Structure::kPattern ||
                  kStructure == Structure::kVoxels) {
      s.part = medium;
    }
    Scatter(words, g, hn::RebindMask(Floats(), scatters), s);
  }

  HWY_INLINE HWY_ATTR void Scatter(const FourWords& words,
                                   F g,
                                   Mask scatters,
                                   State& s) const {
    F cos_azimuth;
    F sin_azimuth;
    OnCircle(words.d, cos_azimuth, sin_azimuth);
    Direction u;
    if constexpr (kIsotropic) {
      u.z = Symmetric(words.c);
      const F sine = SineOf(u.z);
      u.x = hn::Mul(sine, cos_azimuth);
      u.y = hn::Mul(sine, sin_azimuth);
    } else {
      u = Turn(
          s, HenyeyGreensteinCosine(Symmetric(words.c), g), cos_azimuth, sin_azimuth);
    }
    s.ux = hn::IfThenElse(scatters, u.x, s.ux);
    s.uy = hn::IfThenElse(scatters, u.y, s.uy);
    s.uz = hn::IfThenElse(scatters, u.z, s.uz);
    const Words32 du;
    s.scattered =
        hn::Or(s.scattered, hn::VecFromMask(du, hn::RebindMask(du, scatters)));
  }

  // A flight that would end outside: where it started, its random words, and the
  // planes above and below.
  struct Crossing {
    const State& before;
    const FourWords& words;
    Mask lanes;
    F top, bottom;
  };

  // Stops the lanes of the crossing at their first face; there they are reflected,
  // leave, or change layers.
  HWY_INLINE HWY_ATTR void MeetFace(const Crossing& c, State& s) const {
    const Floats d;
    const F zero = hn::Zero(d);
    const State& before = c.before;
    const F far = Set(3e38F);
    const Mask up = hn::Lt(before.uz, zero);
    const F plane = hn::IfThenElse(up, c.top, c.bottom);
    F distance = hn::Div(hn::Sub(plane, before.z), before.uz);
    Mask at_plane = c.lanes;
    Mask at_x = hn::FirstN(d, 0);
    Mask at_y = at_x;
    if constexpr (kBox) {
      distance = hn::IfThenElse(hn::Eq(before.uz, zero), far, distance);
      const F wall_x = hn::CopySign(Set(volume_.half_x_mm), before.ux);
      const F wall_y = hn::CopySign(Set(volume_.half_y_mm), before.uy);
      F to_x = hn::Div(hn::Sub(wall_x, before.x), before.ux);
      F to_y = hn::Div(hn::Sub(wall_y, before.y), before.uy);
      to_x = hn::IfThenElse(hn::Eq(before.ux, zero), far, to_x);
      to_y = hn::IfThenElse(hn::Eq(before.uy, zero), far, to_y);
      at_x = hn::And(c.lanes, hn::And(hn::Lt(to_x, distance), hn::Le(to_x, to_y)));
      at_y = hn::AndNot(at_x, hn::And(c.lanes, hn::Lt(to_y, distance)));
      at_plane = hn::AndNot(hn::Or(at_x, at_y), c.lanes);
      distance = hn::Min(distance, hn::Min(to_x, to_y));
    }
    s.x = hn::IfThenElse(c.lanes, hn::Add(before.x, hn::Mul(distance, before.ux)), s.x);
    s.y = hn::IfThenElse(c.lanes, hn::Add(before.y, hn::Mul(distance, before.uy)), s.y);
    s.z = hn::IfThenElse(c.lanes, hn::Add(before.z, hn::Mul(distance, before.uz)), s.z);
    s.z = hn::IfThenElse(at_plane, plane, s.z);
    const F u = UnitBelowOne(c.words.b);
    if constexpr (kBox) {
      s.x = hn::IfThenElse(at_x, hn::CopySign(Set(volume_.half_x_mm), before.ux), s.x);
      s.y = hn::IfThenElse(at_y, hn::CopySign(Set(volume_.half_y_mm), before.uy), s.y);
      MeetWall(at_x, u, s.ux, s);
      MeetWall(at_y, u, s.uy, s);
    }
    if constexpr (kStructure == Structure::kLayers) {
      MeetLayer(c, up, u, s);
    } else {
      const F ratio = Set(1 / volume_.eta_top);
      const F reflectance = Fresnel(hn::Abs(s.uz), ratio);
      MeetTop(hn::And(at_plane, up), hn::Lt(u, reflectance), s);
      MeetBottom(hn::AndNot(up, at_plane), hn::Lt(u, reflectance), c.words, s);
    }
  }

  HWY_INLINE HWY_ATTR static void End(Mask lanes, Fate fate, State& s) {
    const Words32 du;
    s.fate = hn::IfThenElse(hn::RebindMask(du, lanes),
                            hn::Set(du, static_cast<std::uint32_t>(fate)),
                            s.fate);
  }

  HWY_INLINE HWY_ATTR static F NegateIn(Mask lanes, F x) {
    return hn::IfThenElse(lanes, hn::Neg(x), x);
  }

  HWY_INLINE HWY_ATTR void MeetWall(Mask lanes, F u, F& across, State& s) const {
    const F reflectance = Fresnel(hn::Abs(across), Set(1 / volume_.eta_top));
    const Mask reflected = hn::And(lanes, hn::Lt(u, reflectance));
    across = NegateIn(reflected, across);
    End(hn::AndNot(reflected, lanes), Fate::kSides, s);
  }

  HWY_INLINE HWY_ATTR static void MeetTop(Mask lanes, Mask reflects, State& s) {
    const Mask reflected = hn::And(lanes, reflects);
    s.uz = NegateIn(reflected, s.uz);
    End(hn::AndNot(reflected, lanes), Fate::kReflected, s);
  }

  HWY_INLINE HWY_ATTR void MeetBottom(Mask lanes,
                                      Mask reflects,
                                      const FourWords& words,
                                      State& s) const {
    switch (volume_.bottom) {
      case Bottom::kAir: {
        const Mask reflected = hn::And(lanes, reflects);
        s.uz = NegateIn(reflected, s.uz);
        End(hn::AndNot(reflected, lanes), Fate::kTransmitted, s);
        break;
      }
      case Bottom::kMatched:
        End(lanes, Fate::kTransmitted, s);
        break;
      case Bottom::kBlack:
        End(lanes, Fate::kBacking, s);
        break;
      case Bottom::kWhite: {
        // Lambert's law: the cosine's square is uniform.
        const F cosine = hn::Sqrt(UnitPositive(words.c));
        const F sine = SineOf(cosine);
        F cos_azimuth;
        F sin_azimuth;
        OnCircle(words.d, cos_azimuth, sin_azimuth);
        s.ux = hn::IfThenElse(lanes, hn::Mul(sine, cos_azimuth), s.ux);
        s.uy = hn::IfThenElse(lanes, hn::Mul(sine, sin_azimuth), s.uy);
        s.uz = hn::IfThenElse(lanes, hn::Neg(cosine), s.uz);
        break;
      }
    }
  }

  HWY_INLINE HWY_ATTR void MeetLayer(const Crossing& c, Mask up, F u, State& s) const {
    const Floats d;
    const Ints di;
    const F ratio = hn::IfThenElse(up,
                                   GatherFloat(volume_.eta_ratio_up, s.part),
                                   GatherFloat(volume_.eta_ratio_down, s.part));
    const auto last_layer = static_cast<std::int32_t>(volume_.g.size() - 1);
    const Mask top_face = hn::And(up, hn::RebindMask(d, hn::Eq(s.part, hn::Zero(di))));
    const Mask bottom_face =
        hn::AndNot(up, hn::RebindMask(d, hn::Eq(s.part, hn::Set(di, last_layer))));
    const Mask reflects = hn::Lt(u, Fresnel(hn::Abs(s.uz), ratio));
    MeetTop(hn::And(c.lanes, top_face), reflects, s);
    MeetBottom(hn::And(c.lanes, bottom_face), reflects, c.words, s);
    const Mask between = hn::AndNot(hn::Or(top_face, bottom_face), c.lanes);
    const Mask reflected = hn::And(between, reflects);
    const Mask crosses = hn::AndNot(reflected, between);
    const F inverse = hn::Div(Set(1.0F), ratio);
    const F ux = hn::Mul(s.ux, inverse);
    const F uy = hn::Mul(s.uy, inverse);
    const F cos2 = hn::Sub(Set(1.0F), hn::Add(Square(ux), Square(uy)));
    const F uz = hn::CopySign(hn::Sqrt(hn::Max(cos2, hn::Zero(d))), s.uz);
    s.ux = hn::IfThenElse(crosses, ux, s.ux);
    s.uy = hn::IfThenElse(crosses, uy, s.uy);
    s.uz = hn::IfThenElse(crosses, uz, NegateIn(reflected, s.uz));
    const I toward =
        hn::IfThenElse(hn::RebindMask(di, up), hn::Set(di, -1), hn::Set(di, 1));
    s.part =
        hn::IfThenElse(hn::RebindMask(di, crosses), hn::Add(s.part, toward), s.part);
  }

  const PacketVolume& volume_;
  std::uint32_t photon_high_;
  std::array<std::uint32_t, 5> key_{};
};

template <Structure kStructure, bool kBox, bool kIsotropic>
HWY_ATTR void RunLoop(const PacketJob& job, std::uint32_t photon_high, Roster& roster) {
  Loop<kStructure, kBox, kIsotropic>(job, photon_high).Run(roster);
}

template <Structure kStructure>
HWY_ATTR void ChooseLoop(const PacketJob& job,
                         std::uint32_t photon_high,
                         Roster& roster) {
  const bool box = job.packet_volume.box;
  if (job.packet_volume.isotropic) {
    box ? RunLoop<kStructure, true, true>(job, photon_high, roster)
        : RunLoop<kStructure, false, true>(job, photon_high, roster);
  } else {
    box ? RunLoop<kStructure, true, false>(job, photon_high, roster)
        : RunLoop<kStructure, false, false>(job, photon_high, roster);
  }
}

HWY_ATTR void RunPacket(const PacketJob& job,
                        std::int64_t begin,
                        std::int64_t end,
                        CountTally& tally) {
  Roster roster(job, begin, end, tally);
  for (std::size_t lane = 0; lane < hn::Lanes(Floats()); ++lane) {
    roster.Launch(lane);
  }
  const auto photon_high =
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(begin) >> 32);
  switch (job.packet_volume.structure) {
    case Structure::kHomogeneous:
      return ChooseLoop<Structure::kHomogeneous>(job, photon_high, roster);
    case Structure::kPattern:
      return ChooseLoop<Structure::kPattern>(job, photon_high, roster);
    case Structure::kVoxels:
      return ChooseLoop<Structure::kVoxels>(job, photon_high, roster);
    case Structure::kLayers:
      return RunLoop<Structure::kLayers, false, false>(job, photon_high, roster);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace nacre::rigs::monte_carlo::internal
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::rigs::monte_carlo::internal {

HWY_EXPORT(RunPacket);

void RunPhotons(const PacketJob& job,
                std::int64_t begin,
                std::int64_t end,
                CountTally& tally) {
  // Lanes share the upper half of their photons' numbers.
  while (begin < end) {
    const std::int64_t stop = std::min(end, ((begin >> 32) + 1) << 32);
    HWY_DYNAMIC_DISPATCH(RunPacket)(job, begin, stop, tally);
    begin = stop;
  }
}

std::vector<std::string> SupportedInstructionSets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    names.emplace_back(hwy::TargetName(target));
  }
  return names;
}

void ChooseInstructionSet(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);  // all again
  if (name.empty()) {
    return;
  }
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    if (name == hwy::TargetName(target)) {
      hwy::SetSupportedTargetsForTest(target);
      return;
    }
  }
  throw UsageError(
      fmt::format("instruction set {}: this machine or build doesn't have it", name));
}

}  // namespace nacre::rigs::monte_carlo::internal
#endif
