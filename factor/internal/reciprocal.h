#pragma once

#include "factor/internal/bilinear.h"
#include "factor/material.h"

namespace nacre::factor::internal {

/// R'_d of a reciprocal material, without row_scale. Every sum runs over what is the
/// same from both ends in the same order, and so R'_d(x_i, d) and R'_d(x_o, −d) are
/// equal to the last bit, but for the factor that sides make. What lies beyond the maps
/// is as their nearest point.
float ReciprocalCell(const Material& m, int channel, GridIndex point, GridIndex cell);

/// The whole windows of a point in some channels, one after the other: the same values.
void ReciprocalWindows(const Material& m,
                       GridIndex point,
                       int first_channel,
                       int channels,
                       float* windows);

/// row_scale(x_i) · row_scale(x_o), which is taken as 1 for x_o beyond the grid.
float PairScale(const Material& m, int channel, GridIndex point, GridIndex cell);

/// ReciprocalWindows of all channels, row_scale at both ends included.
void ScaledReciprocalWindows(const Material& m, GridIndex point, float* windows);

}  // namespace nacre::factor::internal
