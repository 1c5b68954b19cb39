// How many regions lie behind one another in a picture.
#pragma once

#include "viewer/lod_selection.h"

namespace cairn::viewer {

/// Over the part of the picture that regions of the front cover: how many of their boxes cover a place, on average; 0 of an
/// empty front. Boxes of neighbors overlap, so one surface gives more than 1.
double depth_layers(const LodTree& tree, const View& view, const Selection& selection);

}  // namespace cairn::viewer
