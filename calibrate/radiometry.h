#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"

#include <vector>

namespace nacre::calibrate {

/// The mean of all dark pictures of an exposure, fitted by a line over the exposures.
DarkLevel EstimateDark(const acquire::SessionReader& session);

struct PhotonTransfer {
  double gain_electrons_per_count = 0;
  double read_noise_electrons = 0;
  double saturation_counts = 0;
};

/// Gain and read noise from pairs of flat pictures [Janesick07, EMVA1288 6.6]: half the
/// variance of a pair's difference, in which all that is fixed on the sensor cancels,
/// grows by 1 / gain a count of signal, from the read noise (that of dark pairs) on.
/// Pairs in which that variance has collapsed are saturated; they show at which count
/// the sensor does so, if that's below the converter's last.
PhotonTransfer EstimatePhotonTransfer(const acquire::SessionReader& session,
                                      const DarkLevel& dark);

/// The flux scale of every channel, see ChannelResponse, from the pictures of the
/// reference target. `saturation_counts` must not be reached in them.
std::vector<ChannelResponse> EstimateFluxScales(const acquire::SessionReader& session,
                                                const CameraGeometry& camera,
                                                const acquire::ScanMap& map,
                                                const DarkLevel& dark,
                                                double saturation_counts);

}  // namespace nacre::calibrate
