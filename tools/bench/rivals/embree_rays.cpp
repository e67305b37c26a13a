#include "tools/bench/rivals/embree_rays.h"

#include <array>
#include <atomic>
#include <cmath>
#include <unordered_map>

#include <embree3/rtcore.h>

#include "tools/bench/benchmark.h"

namespace tools {

namespace {

using world::Vec3f;

/// A ray starts on the very face that it must not meet: Embree's own remedy, in lengths of the direction.
constexpr float kNear = 1e-4f;

constexpr size_t kWide = 16;
/// Sixteen rays, the last of a set repeated to fill it.
struct alignas(64) Block {
  float origin[3][kWide], direction[3][kWide];
};

constexpr size_t kBlocksAtOnce = kRaysAtOnce / kWide;

template <int width>
struct Packet;
template <>
struct Packet<8> {
  using RayHit = RTCRayHit8;
  using Ray = RTCRay8;
  static constexpr auto intersect = rtcIntersect8;
  static constexpr auto occluded = rtcOccluded8;
};
template <>
struct Packet<16> {
  using RayHit = RTCRayHit16;
  using Ray = RTCRay16;
  static constexpr auto intersect = rtcIntersect16;
  static constexpr auto occluded = rtcOccluded16;
};

template <int width, class Ray>
void fill(Ray& ray, const Block& block, size_t at) {
  for (size_t i = 0; i < width; ++i) {
    ray.org_x[i] = block.origin[0][at + i], ray.org_y[i] = block.origin[1][at + i];
    ray.org_z[i] = block.origin[2][at + i];
    ray.dir_x[i] = block.direction[0][at + i], ray.dir_y[i] = block.direction[1][at + i];
    ray.dir_z[i] = block.direction[2][at + i];
    ray.tnear[i] = kNear, ray.tfar[i] = INFINITY, ray.time[i] = 0, ray.mask[i] = ~0u, ray.flags[i] = 0;
  }
}

void fill_one(RTCRay& ray, const Block& block, size_t i) {
  ray.org_x = block.origin[0][i], ray.org_y = block.origin[1][i], ray.org_z = block.origin[2][i];
  ray.dir_x = block.direction[0][i], ray.dir_y = block.direction[1][i], ray.dir_z = block.direction[2][i];
  ray.tnear = kNear, ray.tfar = INFINITY, ray.time = 0, ray.mask = ~0u, ray.flags = 0;
}

void reset_hit(RTCHit& hit) { hit.geomID = hit.primID = hit.instID[0] = RTC_INVALID_GEOMETRY_ID; }

/// What a caller keeps of a hit; RTC_INVALID_GEOMETRY_ID where there is none.
struct Hit {
  float t;
  unsigned primitive;
};

alignas(64) const int kAllValid[kWide] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};

template <int width>
void intersect_blocks(RTCScene scene, RTCIntersectContext& context, std::span<const Block> blocks, Hit* hits) {
  alignas(64) typename Packet<width>::RayHit packet;
  for (const Block& block : blocks)
    for (size_t at = 0; at < kWide; at += width) {
      fill<width>(packet.ray, block, at);
      for (int i = 0; i < width; ++i)
        packet.hit.geomID[i] = packet.hit.primID[i] = packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      Packet<width>::intersect(kAllValid, scene, &context, &packet);
      for (int i = 0; i < width; ++i) hits[i] = {packet.ray.tfar[i], packet.hit.primID[i]};
      hits += width;
    }
}

template <int width>
void occlude_blocks(RTCScene scene, RTCIntersectContext& context, std::span<const Block> blocks, bool* blocked) {
  alignas(64) typename Packet<width>::Ray packet;
  for (const Block& block : blocks)
    for (size_t at = 0; at < kWide; at += width) {
      fill<width>(packet, block, at);
      Packet<width>::occluded(kAllValid, scene, &context, &packet);
      for (int i = 0; i < width; ++i) blocked[i] = packet.tfar[i] < 0;
      blocked += width;
    }
}

RTCIntersectContext context_for(EmbreeHint hint) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      hint == EmbreeHint::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

void add_corners(const render::ExtractedChunk& chunk, std::vector<Vec3f>& corners) {
  for (const render::FaceRecord& record : chunk.records)
    for (unsigned corner = 0; corner < 4; ++corner) {
      const auto offset = render::face_corner(record.word0, record.word1, corner);
      corners.push_back(Vec3f(chunk.origin.x + static_cast<int>(offset.x), chunk.origin.y + static_cast<int>(offset.y),
                              chunk.origin.z + static_cast<int>(offset.z)));
    }
}

/// Puts rectangles into a scene, four corners each.
void add_rectangles(RTCDevice device, RTCScene scene, std::span<const Vec3f> corners, EmbreeShape shape,
                    RTCBuildQuality quality) {
  const bool quads = shape == EmbreeShape::quads;
  RTCGeometry geometry = rtcNewGeometry(device, quads ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, quality);
  auto* vertices = static_cast<Vec3f*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), corners.size()));
  std::copy(corners.begin(), corners.end(), vertices);
  const size_t rectangles = corners.size() / 4;
  auto* indices = static_cast<unsigned*>(
      quads ? rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 16, rectangles)
            : rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 2 * rectangles));
  constexpr unsigned kQuad[] = {0, 1, 2, 3}, kTriangles[] = {0, 1, 2, 0, 2, 3};
  for (unsigned first = 0; first < 4 * rectangles; first += 4)
    for (unsigned corner : quads ? std::span<const unsigned>(kQuad) : std::span<const unsigned>(kTriangles))
      *indices++ = first + corner;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

/// A committed scene of them.
RTCScene scene_of(RTCDevice device, std::span<const Vec3f> corners, EmbreeShape shape, RTCBuildQuality quality) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneBuildQuality(scene, quality);
  add_rectangles(device, scene, corners, shape, quality);
  rtcCommitScene(scene);
  return scene;
}

void add_instance(RTCDevice device, RTCScene into, RTCScene shape, const Vec3f& offset) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, shape);
  const float transform[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, offset.x, offset.y, offset.z};
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(into, geometry);
  rtcReleaseGeometry(geometry);
}

RTCRayHit trace_one(RTCScene scene, RTCIntersectContext& context, const BenchRay& ray) {
  RTCRayHit one;
  RTCRay& r = one.ray;
  r.org_x = static_cast<float>(ray.voxel.x) + ray.fraction.x,
  r.org_y = static_cast<float>(ray.voxel.y) + ray.fraction.y;
  r.org_z = static_cast<float>(ray.voxel.z) + ray.fraction.z;
  r.dir_x = ray.direction.x, r.dir_y = ray.direction.y, r.dir_z = ray.direction.z;
  r.tnear = kNear, r.tfar = INFINITY, r.time = 0, r.mask = ~0u, r.flags = 0;
  reset_hit(one.hit);
  rtcIntersect1(scene, &context, &one);
  return one;
}

/// The voxel behind the face: faces lie in integer planes, and rays come from outside.
RayAnswer answer_one(RTCScene scene, RTCIntersectContext& context, const BenchRay& ray) {
  const RTCRayHit one = trace_one(scene, context, ray);
  RayAnswer answer{one.hit.geomID != RTC_INVALID_GEOMETRY_ID, {}};
  const float normal[3] = {std::abs(one.hit.Ng_x), std::abs(one.hit.Ng_y), std::abs(one.hit.Ng_z)};
  const int axis = normal[0] > normal[1] ? (normal[0] > normal[2] ? 0 : 2) : (normal[1] > normal[2] ? 1 : 2);
  for (int a = 0; a < 3 && answer.hit; ++a) {
    const double at = double(ray.voxel[a]) + ray.fraction[a] + double(one.ray.tfar) * ray.direction[a];
    answer.voxel[a] = static_cast<int>(a != axis              ? std::floor(at)
                                       : ray.direction[a] > 0 ? std::round(at)
                                                              : std::round(at) - 1);
  }
  return answer;
}

bool count_bytes(void* total, ssize_t bytes, bool) {
  *static_cast<std::atomic<int64_t>*>(total) += bytes;
  return true;
}

}  // namespace

struct EmbreeRays::Loaded {
  std::vector<Block> blocks;
  size_t rays = 0;
};

struct EmbreeRays::State {
  std::atomic<int64_t> bytes{0};
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<RTCScene> shapes;
  ~State() {
    if (scene) rtcReleaseScene(scene);
    for (RTCScene shape : shapes) rtcReleaseScene(shape);
    if (device) rtcReleaseDevice(device);
  }
  void make_device() {
    device = rtcNewDevice(nullptr);
    CHECK(device);
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, &bytes);
  }
  void check() const { CHECK_EQ(static_cast<int>(rtcGetDeviceError(device)), static_cast<int>(RTC_ERROR_NONE)); }
};

EmbreeFaces embree_faces(const world::World& world) {
  render::Extractor extractor;
  extractor.rebuild(world::WorldView(world), {.merge_faces = true, .sealed_cavities = false});
  EmbreeFaces faces;
  for (const render::ExtractedChunk* chunk : extractor.chunks()) add_corners(*chunk, faces.corners);
  return faces;
}

EmbreeRays::EmbreeRays(const EmbreeFaces& faces, EmbreeShape shape, EmbreeQuality quality) : state_(new State) {
  state_->make_device();
  state_->scene = scene_of(state_->device, faces.corners, shape,
                           quality == EmbreeQuality::high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
  state_->check();
}

EmbreeRays::EmbreeRays(const EmbreeFaces& once, std::span<const EmbreeFaces> shapes,
                       std::span<const EmbreeInstance> instances)
    : state_(new State) {
  state_->make_device();
  for (const EmbreeFaces& shape : shapes)
    state_->shapes.push_back(scene_of(state_->device, shape.corners, EmbreeShape::triangles, RTC_BUILD_QUALITY_MEDIUM));
  state_->scene = rtcNewScene(state_->device);
  add_rectangles(state_->device, state_->scene, once.corners, EmbreeShape::triangles, RTC_BUILD_QUALITY_MEDIUM);
  for (const EmbreeInstance& instance : instances)
    add_instance(state_->device, state_->scene, state_->shapes[instance.shape], instance.offset);
  rtcCommitScene(state_->scene);
  state_->check();
}

void EmbreeRays::place(const EmbreeInstance& instance) {
  add_instance(state_->device, state_->scene, state_->shapes[instance.shape], instance.offset);
  rtcCommitScene(state_->scene);
}

EmbreeRays::~EmbreeRays() = default;

size_t EmbreeRays::bytes() const { return static_cast<size_t>(state_->bytes.load()); }

std::shared_ptr<const EmbreeRays::Loaded> EmbreeRays::load(std::span<const BenchRay> rays) {
  auto loaded = std::make_shared<Loaded>();
  loaded->rays = rays.size();
  loaded->blocks.resize((rays.size() + kWide - 1) / kWide);
  for (size_t i = 0; i < loaded->blocks.size() * kWide; ++i) {
    const BenchRay& ray = rays[std::min(i, rays.size() - 1)];
    Block& block = loaded->blocks[i / kWide];
    for (int a = 0; a < 3; ++a) {
      block.origin[a][i % kWide] = static_cast<float>(ray.voxel[a]) + ray.fraction[a];
      block.direction[a][i % kWide] = ray.direction[a];
    }
  }
  return loaded;
}

double EmbreeRays::first_hits(const Loaded& rays, EmbreeWidth width, EmbreeHint hint) const {
  cast_in_parallel(rays.blocks.size() * kWide, [&](size_t begin, size_t end) {
    thread_local std::vector<Hit> hits(kRaysAtOnce);
    thread_local std::vector<RTCRayHit> stream(kRaysAtOnce);
    const std::span blocks(&rays.blocks[begin / kWide], (end - begin) / kWide);
    RTCIntersectContext context = context_for(hint);
    switch (width) {
      case EmbreeWidth::eight:
        intersect_blocks<8>(state_->scene, context, blocks, hits.data());
        break;
      case EmbreeWidth::sixteen:
        intersect_blocks<16>(state_->scene, context, blocks, hits.data());
        break;
      case EmbreeWidth::one:
        for (size_t i = 0; i < end - begin; ++i) {
          RTCRayHit one;
          fill_one(one.ray, blocks[i / kWide], i % kWide);
          reset_hit(one.hit);
          rtcIntersect1(state_->scene, &context, &one);
          hits[i] = {one.ray.tfar, one.hit.primID};
        }
        break;
      case EmbreeWidth::stream:
        for (size_t i = 0; i < end - begin; ++i) {
          fill_one(stream[i].ray, blocks[i / kWide], i % kWide);
          reset_hit(stream[i].hit);
        }
        rtcIntersect1M(state_->scene, &context, stream.data(), static_cast<unsigned>(end - begin), sizeof(RTCRayHit));
        for (size_t i = 0; i < end - begin; ++i) hits[i] = {stream[i].ray.tfar, stream[i].hit.primID};
        break;
    }
    keep(hits[0]);
  });
  return static_cast<double>(rays.rays);
}

double EmbreeRays::any_hits(const Loaded& rays, EmbreeWidth width, EmbreeHint hint) const {
  cast_in_parallel(rays.blocks.size() * kWide, [&](size_t begin, size_t end) {
    thread_local std::array<bool, kRaysAtOnce> hits;
    thread_local std::vector<RTCRay> stream(kRaysAtOnce);
    const std::span blocks(&rays.blocks[begin / kWide], (end - begin) / kWide);
    RTCIntersectContext context = context_for(hint);
    switch (width) {
      case EmbreeWidth::eight:
        occlude_blocks<8>(state_->scene, context, blocks, hits.data());
        break;
      case EmbreeWidth::sixteen:
        occlude_blocks<16>(state_->scene, context, blocks, hits.data());
        break;
      case EmbreeWidth::one:
        for (size_t i = 0; i < end - begin; ++i) {
          RTCRay one;
          fill_one(one, blocks[i / kWide], i % kWide);
          rtcOccluded1(state_->scene, &context, &one);
          hits[i] = one.tfar < 0;
        }
        break;
      case EmbreeWidth::stream:
        for (size_t i = 0; i < end - begin; ++i) fill_one(stream[i], blocks[i / kWide], i % kWide);
        rtcOccluded1M(state_->scene, &context, stream.data(), static_cast<unsigned>(end - begin), sizeof(RTCRay));
        for (size_t i = 0; i < end - begin; ++i) hits[i] = stream[i].tfar < 0;
        break;
    }
    keep(hits[0]);
  });
  return static_cast<double>(rays.rays);
}

std::vector<RayAnswer> EmbreeRays::answers(std::span<const BenchRay> rays) const {
  RTCIntersectContext context = context_for(EmbreeHint::incoherent);
  std::vector<RayAnswer> answers;
  for (const BenchRay& ray : rays) answers.push_back(answer_one(state_->scene, context, ray));
  return answers;
}

std::vector<float> EmbreeRays::distances(std::span<const BenchRay> rays) const {
  RTCIntersectContext context = context_for(EmbreeHint::incoherent);
  std::vector<float> distances;
  for (const BenchRay& ray : rays) distances.push_back(trace_one(state_->scene, context, ray).ray.tfar);
  return distances;
}

struct EmbreeChunks::State {
  struct Chunk {
    RTCGeometry instance = nullptr;
    uint64_t version = 0;
  };
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::unordered_map<render::ChunkPos, Chunk, world::PosHash> chunks;
  std::vector<Vec3f> corners;
  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

EmbreeChunks::EmbreeChunks(const render::Extractor& extractor) : state_(new State) {
  state_->device = rtcNewDevice(nullptr);
  CHECK(state_->device);
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_DYNAMIC);
  rtcSetSceneBuildQuality(state_->scene, RTC_BUILD_QUALITY_LOW);
  update(extractor);
}
EmbreeChunks::~EmbreeChunks() = default;

void EmbreeChunks::update(const render::Extractor& extractor) {
  for (const render::ExtractedChunk* chunk : extractor.chunks()) {
    State::Chunk& mine = state_->chunks[chunk->pos];
    if (mine.version == chunk->version) continue;
    mine.version = chunk->version;
    state_->corners.clear();
    add_corners(*chunk, state_->corners);
    RTCScene scene = scene_of(state_->device, state_->corners, EmbreeShape::quads, RTC_BUILD_QUALITY_LOW);
    const bool added = !mine.instance;
    if (added) mine.instance = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(mine.instance, scene);
    rtcReleaseScene(scene);
    rtcCommitGeometry(mine.instance);
    if (added) {
      rtcAttachGeometry(state_->scene, mine.instance);
      rtcReleaseGeometry(mine.instance);  // the scene holds it
    }
  }
  rtcCommitScene(state_->scene);
  CHECK_EQ(static_cast<int>(rtcGetDeviceError(state_->device)), static_cast<int>(RTC_ERROR_NONE));
}

RayAnswer EmbreeChunks::first_hit(const BenchRay& ray) const {
  RTCIntersectContext context = context_for(EmbreeHint::incoherent);
  return answer_one(state_->scene, context, ray);
}

}  // namespace tools
