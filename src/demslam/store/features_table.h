#pragma once

#include <memory>

#include "demslam/store/map_store.h"
#include "demslam/store/sqlite.h"

namespace demslam {

inline constexpr const char* kInsertFeatures = "INSERT INTO features VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)";
inline constexpr const char* kSelectFeatures = "SELECT * FROM features WHERE keyframe = ?";

/// Runs an insertion of kInsertFeatures.
void insert_features(Statement& insert, std::size_t keyframe, const StereoFeatures& features, DescriptorCoding coding);

/// The features of a statement's present row. Throws Error when the arrays do not fit each other.
std::shared_ptr<const StereoFeatures> features_of(const Statement& row);

}  // namespace demslam
