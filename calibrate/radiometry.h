#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/dark.h"
#include "calibrate/rate_picture.h"

#include <vector>

namespace nacre::calibrate {

struct PhotonTransfer {
  double gain_electrons_per_count = 0;
  double gain_sigma_electrons_per_count = 0;
  double read_noise_electrons = 0;  ///< without what rows have in common
  double read_noise_sigma_electrons = 0;
  double saturation_counts = 0;
};

/// Gain and read noise from pairs of flat pictures [Janesick07, EMVA1288 6.6]: half the
/// variance of a pair's difference, in which all that is fixed on the sensor cancels,
/// grows by 1 / gain a count of signal, from the read noise (that of dark pairs) on.
/// Both are made linear first. Pairs in which that variance has collapsed are
/// saturated; they show at which count the sensor does so, if that's below the
/// converter's last.
PhotonTransfer EstimatePhotonTransfer(const acquire::SessionReader& session,
                                      const DarkResult& dark,
                                      const Linearity& linearity = {});

struct FluxResult {
  std::vector<ChannelResponse> channels;
  std::vector<SpotProfile> spots;  ///< a channel
  LightNoise light_noise;
};

/// A round figure of the widest channel's spot on the reference, lens included: its
/// standard deviation, were it Gaussian.
double SpotSigmaMm(const acquire::SessionReader& session,
                   const CameraGeometry& camera,
                   const acquire::ScanMap& map,
                   const RatePictures& pictures);

/// The flux scale of every channel, see ChannelResponse, from the pictures of the
/// reference target, and what the spots there say of the laser: their shape; their
/// power's ripple, from one picture to the next; speckle, from one spot to the next
/// (whatever else makes spots differ counts as speckle). `saturation_counts` must not
/// be reached in the pictures.
FluxResult EstimateFluxScales(const acquire::SessionReader& session,
                              const CameraGeometry& camera,
                              const acquire::ScanMap& map,
                              const RatePictures& pictures,
                              const PhotonTransfer& transfer);

}  // namespace nacre::calibrate
