/// Laws of sampling, on every analytic source: middles of voxels are right, nothing is missed, volumes converge.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "tests/world/sources/sources_support.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace world {
namespace {

constexpr double kPi = std::numbers::pi;

struct Case {
  std::string name, keys;
  double volume;  // closed form, m^3; 0 where there is none
};

/// Placed off the grid, so that no symmetry helps.
const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"sphere", "kind='implicit'\nsurface='sphere'\nradius=9.3", 4.0 / 3 * kPi * 9.3 * 9.3 * 9.3},
      {"box", "kind='implicit'\nsurface='box'\nsize=[13.2, 7.7, 5.1]", 13.2 * 7.7 * 5.1},
      {"cylinder", "kind='implicit'\nsurface='cylinder'\nradius=6.2\nheight=11.5", kPi * 6.2 * 6.2 * 11.5},
      {"cone", "kind='implicit'\nsurface='cone'\nradius=8.4\nheight=15.5", kPi * 8.4 * 8.4 * 15.5 / 3},
      {"frustum", "kind='implicit'\nsurface='cone'\nradius=8.4\nheight=9.5\ntop_radius=3.1",
       kPi * 9.5 / 3 * (8.4 * 8.4 + 8.4 * 3.1 + 3.1 * 3.1)},
      {"torus", "kind='implicit'\nsurface='torus'\nradius=10\ntube_radius=3.3", 2 * kPi * kPi * 10 * 3.3 * 3.3},
      {"ellipsoid",
       "kind='implicit'\nsurface='quadric'\ncoefficients=[0.01, 0.02, 0.04, 0, 0, 0, 0, 0, 0, -1]\n"
       "min=[-20,-20,-20]\nmax=[20,20,20]",
       4.0 / 3 * kPi * 10 * (1 / std::sqrt(0.02)) * 5},
      {"waves",
       "kind='heightfield'\nsize=[24, 20]\nbase_m=-6\n[[source.wave]]\namplitude_m=2\nwavelength_m=12\n"
       "[[source.wave]]\namplitude_m=1.5\nwavelength_m=10\ndirection_deg=90\nphase_deg=45",
       24 * 20 * 6},
      {"table", "kind='heightfield'\nsize=[12, 8]\ncolumns=3\nrows=2\nbase_m=-3\nheights=[1, 5, 2, 4, 0, 7]",
       // A bilinear patch has the mean of its corners.
       12.0 * 8 * 3 + 48 * (1 + 5 + 4 + 0) / 4 + 48 * (5 + 2 + 0 + 7) / 4},
      {"ball", "kind='metaballs'\n[[source.ball]]\nposition=[0,0,0]\nradius=8", 4.0 / 3 * kPi * 512},
      {"blobs",
       "kind='metaballs'\n[[source.ball]]\nposition=[-5,0,0]\nradius=6\n[[source.ball]]\nposition=[5,1,0]\nradius=5\n"
       "[[source.ball]]\nposition=[0,4,2]\nradius=3\nsign=-1",
       0},
  };
  return all;
}

const char* const kTilted = "\nposition=[3.37, -1.81, 5.29]\nrotate_deg=[31, 17, 49]";

std::string with(const Case& c, const std::string& keys) {
  // Keys of the source come before its tables.
  const size_t at = c.keys.find("\n[[");
  return at == std::string::npos ? c.keys + keys : c.keys.substr(0, at) + keys + c.keys.substr(at);
}

TEST(Sampler, EveryVoxelIsWhatItsMiddleSays) {
  for (const Case& c : cases()) {
    const bool clipped = c.keys.find("min=") != std::string::npos;
    const auto source = source_from(with(c, clipped ? "" : kTilted));
    ASSERT_TRUE(source.ok()) << c.name << ": " << source.error().message;
    const auto sampled = sample(*source);
    ASSERT_TRUE(sampled.ok()) << c.name << ": " << sampled.error().message;
    const glm::dmat3 back = glm::inverse(source->placement.transform);
    int filled = 0;
    for (int x = -26; x <= 34; ++x) {
      for (int y = -26; y <= 34; ++y) {
        for (int z = -26; z <= 34; ++z) {
          const Vec3d p = back * (WorldPoint{{x, y, z}, Vec3d(0.5)} - source->placement.position);
          const bool inside = source->shape->contains(p) && (!source->clip || source->clip->contains({x, y, z}));
          filled += inside;
          ASSERT_EQ(sampled->store.get({x, y, z}) != kAir, inside) << c.name << " at " << x << ' ' << y << ' ' << z;
        }
      }
    }
    EXPECT_EQ(static_cast<uint64_t>(filled), sampled->voxels()) << c.name << ": voxels beyond its bounds";
    EXPECT_EQ(sampled->report.voxels, sampled->voxels()) << c.name;
    EXPECT_GT(filled, 100) << c.name;
  }
}

TEST(Sampler, BoxesAreNeverWronglyOutsideOrInside) {
  for (const Case& c : cases()) {
    const auto source = source_from(c.keys);
    ASSERT_TRUE(source.ok()) << source.error().message;
    const Shape& shape = *source->shape;
    const auto draw = [&, n = uint64_t{0}](double low, double high) mutable {
      return low + (high - low) * uniform01_double(random_bits(7, 0, 0, 0, 0, n++));
    };
    auto random = draw;
    int decided = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3d middle(random(-16, 16), random(-16, 16), random(-16, 16)),
          half(random(0.01, 3), random(0.01, 3), random(0.01, 3));
      const Cover cover = shape.classify({middle - half, middle + half});
      if (cover == Cover::mixed) continue;
      ++decided;
      for (int k = 0; k < 24; ++k) {
        // Corners first, then anywhere.
        const Vec3d unit = k < 8 ? Vec3d((k & 1) * 2 - 1, (k >> 1 & 1) * 2 - 1, (k >> 2) * 2 - 1)
                                 : Vec3d(random(-1, 1), random(-1, 1), random(-1, 1));
        ASSERT_EQ(shape.contains(middle + half * unit), cover == Cover::inside) << c.name;
      }
    }
    EXPECT_GT(decided, 500) << c.name << ": hardly any box is decided";
  }
}

TEST(Sampler, VolumesMeetTheClosedForms) {
  for (const Case& c : cases()) {
    if (c.volume == 0) continue;
    const bool clipped = c.keys.find("min=") != std::string::npos;
    const auto fine = sample(with(c, std::string(clipped ? "" : kTilted) + "\nsupersampling=4"));
    ASSERT_TRUE(fine.ok()) << fine.error().message;
    EXPECT_NEAR(static_cast<double>(fine->voxels()) / c.volume, 1, 0.03) << c.name;
  }
  // Twice as fine: eight times the voxels, and nearer.
  const auto finer =
      sample("kind='implicit'\nsurface='torus'\nradius=10\ntube_radius=3.3\nvoxel_size_m=0.25" + std::string(kTilted));
  ASSERT_TRUE(finer.ok());
  EXPECT_NEAR(static_cast<double>(finer->voxels()) / 64 / (2 * kPi * kPi * 10 * 3.3 * 3.3), 1, 2e-3);
}

TEST(Sampler, AtCoverageZeroNoVoxelThatTheSolidTouchesIsMissed) {
  // A sheet a hundredth of a voxel thin lies between the middles of all voxels, and is still there without a hole.
  const std::string sheet = "kind='implicit'\nsurface='box'\nsize=[12.5, 0.01, 12.5]\nposition=[0.5, 0.9, 0.5]";
  const auto missed = sample(sheet), kept = sample(sheet + "\ncoverage=0");
  ASSERT_TRUE(missed.ok() && kept.ok());
  EXPECT_EQ(missed->voxels(), 0u);
  EXPECT_EQ(kept->voxels(), 13u * 13u) << "-5.75 to 6.75 lie in 13 rows of voxels";
  for (int x = -6; x <= 6; ++x)
    for (int z = -6; z <= 6; ++z) EXPECT_NE(kept->store.get({x, 0, z}), kAir);
  // And each voxel that a point of a tilted solid lies in.
  for (const Case& c : cases()) {
    if (c.keys.find("min=") != std::string::npos) continue;
    const auto source = source_from(with(c, std::string(kTilted) + "\ncoverage=0"));
    const auto all = sample(*source);
    ASSERT_TRUE(all.ok());
    const ShapeBox bounds = source->shape->bounds();
    for (uint64_t i = 0; i < 3000; ++i) {
      const auto draw = [&](uint64_t n) { return uniform01_double(random_bits(3, 0, 0, 0, i, n)); };
      const Vec3d p = bounds.min + (bounds.max - bounds.min) * Vec3d(draw(0), draw(1), draw(2));
      if (!source->shape->contains(p)) continue;
      const WorldPoint at = source->placement.position + source->placement.transform * p;
      ASSERT_NE(all->store.get(at.voxel), kAir) << c.name;
    }
  }
}

TEST(Sampler, CoverageOrdersTheVoxels) {
  uint64_t before = UINT64_MAX;
  for (const double coverage : {0.0, 0.01, 0.25, 0.5, 0.75, 1.0}) {
    const auto s = sample(fmt::format(
        "kind='implicit'\nsurface='sphere'\nradius=7.7\nsupersampling=3\ncoverage={}\nposition=[0.3,0.1,0.7]",
        coverage));
    ASSERT_TRUE(s.ok());
    EXPECT_LT(s->voxels(), before) << coverage;
    before = s->voxels();
  }
}

TEST(Sampler, LargeSolidsCostTheirSurface) {
  // A thousand times the volume costs about a hundred times the questions.
  const auto small = sample("kind='implicit'\nsurface='sphere'\nradius=20"),
             large = sample("kind='implicit'\nsurface='sphere'\nradius=200");
  ASSERT_TRUE(small.ok() && large.ok());
  EXPECT_LT(large->report.queries, 130 * small->report.queries);
  EXPECT_LT(large->report.queries, large->voxels() / 8) << "fewer questions than voxels";
  EXPECT_LT(large->store.bytes_memory(), large->voxels() / 2) << "the inside is tiles";
}

TEST(Sampler, TheResultDependsNeitherOnThreadsNorOnPlace) {
  const std::string keys = "kind='implicit'\nsurface='torus'\nradius=90\ntube_radius=31\nrotate_deg=[20, 30, 40]\n";
  const auto all = sample(keys);
  ASSERT_TRUE(all.ok());
  {
    const ThreadLimit one(1);
    EXPECT_EQ(sample(keys)->store.content_hash(), all->store.content_hash());
  }
  // A whole number of voxels away, even at the border of the world, it is the same solid.
  const auto far = sample(keys + "position=[1073000000, -1073000000, 512]");
  ASSERT_TRUE(far.ok()) << far.error().message;
  EXPECT_EQ(far->voxels(), all->voxels());
  const VoxelBox here = all->store.bounds(), there = far->store.bounds();
  EXPECT_EQ(there.min, here.min + (VoxelPos{1073000000, -1073000000, 512}));
}

TEST(Sampler, KeepsWhatIsThereAndCarvesWithAir) {
  Sampled world;
  const BlockId stone = *standard_blocks().find("stone"), granite = *standard_blocks().find("granite");
  const auto ball = source_from("kind='implicit'\nsurface='sphere'\nradius=10"),
             core = source_from("kind='implicit'\nsurface='sphere'\nradius=4");
  const auto add = [&](const SourceInstance& s, BlockId block) {
    ASSERT_TRUE(sample_shape(world.store, *s.shape, s.placement, s.sampling, block).ok());
  };
  add(*ball, stone);
  const uint64_t whole = world.voxels();
  add(*core, granite);
  EXPECT_EQ(world.voxels(), whole);
  EXPECT_EQ(world.store.get({0, 0, 0}), granite);
  EXPECT_EQ(world.store.get({0, 7, 0}), stone);
  add(*core, kAir);
  EXPECT_EQ(world.store.get({0, 0, 0}), kAir);
  EXPECT_EQ(world.voxels(), whole - sample(*core)->voxels());
}

TEST(Sampler, RefusesWhatHasNoEndOrDoesNotFit) {
  const auto plane = sample("kind='implicit'\nsurface='plane'");
  ASSERT_FALSE(plane.ok());
  EXPECT_NE(plane.error().message.find("min"), std::string::npos);
  const auto huge = sample("kind='implicit'\nsurface='sphere'\nradius=100000");
  ASSERT_FALSE(huge.ok());
  EXPECT_NE(huge.error().message.find("regions"), std::string::npos);
  const auto outside = sample("kind='implicit'\nsurface='sphere'\nradius=10\nposition=[1073737727, 0, 0]");
  ASSERT_FALSE(outside.ok());
  EXPECT_NE(outside.error().message.find("border"), std::string::npos);
  // A vast shell of which little lies within the clip box is found quickly.
  const auto part =
      sample("kind='implicit'\nsurface='sphere'\nradius=1000000\nmin=[1000000,-20,-20]\nmax=[1000002,20,20]");
  ASSERT_TRUE(part.ok()) << part.error().message;
  const auto clipped = sample("kind='implicit'\nsurface='plane'\nmin=[-5,-5,-5]\nmax=[5,5,5]");
  ASSERT_TRUE(clipped.ok());
  EXPECT_EQ(clipped->voxels(), 11u * 11u * 5u);
}

TEST(Sources, ProblemsNameTheirKey) {
  const auto message = [](const std::string& keys) {
    const auto source = source_from(keys);
    return source.ok() ? std::string("none") : source.error().message;
  };
  EXPECT_NE(message("kind='implicitt'").find("did you mean \"implicit\""), std::string::npos);
  EXPECT_NE(message("kind='implicit'\nsurface='sphere'").find("radius"), std::string::npos);
  EXPECT_NE(message("kind='implicit'").find("surface"), std::string::npos);
  EXPECT_NE(message("kind='implicit'\nsurface='sphere'\nradius=1\nsupersampling=99").find("supersampling"),
            std::string::npos);
  EXPECT_NE(message("kind='metaballs'").find("source.ball"), std::string::npos);
  EXPECT_NE(message("kind='mesh'\nfile='nowhere.obj'").find("nowhere.obj"), std::string::npos);
}

}  // namespace
}  // namespace world
