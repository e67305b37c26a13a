#include "world/saves/session.h"

#include "tests/world/saves/saves_support.h"

namespace world {
namespace {

using Session = std::unique_ptr<SaveSession>;

Session start(const std::filesystem::path& path, SaveSession::Options options = {}) {
  auto session = SaveSession::create(path, sample_world(), options);
  EXPECT_TRUE(session.ok()) << session.error().message;
  return std::move(*session);
}

/// How many rows a query counts.
int64_t count(const std::filesystem::path& path, const char* query) {
  auto db = Database::open(path, Database::Access::read);
  EXPECT_TRUE(db.ok());
  return *db->integer(query);
}

TEST(SaveSession, WhatWasEditedIsThereAgain) {
  const TemporaryFolder folder;
  uint64_t expected = 0;
  {
    const Session session = start(folder / "a.loam");
    ASSERT_TRUE(session->world().store.apply(edit_number(1)).ok());
    session->world().metadata["mood"] = "calm";
    Block block;
    block.name = "new_stone";
    const auto id = session->world().palette->add(block);
    EditBatch batch;
    batch.fill({{0, 90, 0}, {20, 95, 20}}, *id);
    ASSERT_TRUE(session->world().store.apply(batch).ok());
    expected = session->world().store.content_hash();
    const Status closed = session->close();
    ASSERT_TRUE(closed.ok()) << closed.error().message;
    EXPECT_FALSE(session->has_changes());
  }
  const auto again = SaveSession::open(folder / "a.loam", {});
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ((*again)->world().store.content_hash(), expected);
  EXPECT_EQ((*again)->world().metadata.at("mood"), "calm");
  EXPECT_TRUE((*again)->world().palette->find("new_stone").has_value());
  EXPECT_FALSE((*again)->has_changes());
  EXPECT_FALSE(std::filesystem::exists(folder / "a.loam-journal"));
}

TEST(SaveSession, OnlyRegionsThatChangedAreWritten) {
  const TemporaryFolder folder;
  const Session session = start(folder / "a.loam");
  EditBatch batch;
  batch.set({-100, 50, -100}, 3);
  batch.set({100, 50, 100}, 3);
  ASSERT_TRUE(session->world().store.apply(batch).ok());
  ASSERT_TRUE(session->save().ok());
  EXPECT_EQ(session->last_report().regions, 2u);
  EXPECT_EQ(session->saves(), 2);
  EXPECT_EQ(count(folder / "a.loam", "SELECT count(*) FROM region WHERE save = 2"), 2);
  ASSERT_TRUE(session->save().ok());
  EXPECT_EQ(session->saves(), 2) << "nothing changed, so nothing is written";
}

TEST(SaveSession, AutosaveBeginsWhenItIsDueAndNotBefore) {
  const TemporaryFolder folder;
  const Session session = start(folder / "a.loam", {.autosave_s = 10});
  ASSERT_TRUE(session->world().store.apply(edit_number(1)).ok());
  session->tick(100);
  session->tick(109.9);
  EXPECT_FALSE(session->is_saving());
  session->tick(110);
  EXPECT_TRUE(session->is_saving());
  ASSERT_TRUE(session->wait().ok());
  EXPECT_EQ(session->saves(), 2);
}

TEST(HardCaseIO20, ASaveHoldsTheMomentInWhichItBeganWhileEditsGoOn) {
  const TemporaryFolder folder;
  const Session session = start(folder / "a.loam");
  Store& store = session->world().store;
  int edit = 0;
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(store.apply(edit_number(++edit)).ok());
    const uint64_t moment = store.content_hash();
    ASSERT_TRUE(session->begin_save());
    int meanwhile = 0;
    while (session->is_saving() && meanwhile < 50) {
      ASSERT_TRUE(store.apply(edit_number(++edit)).ok());
      ++meanwhile;
      session->tick(0);
    }
    ASSERT_TRUE(session->wait().ok());
    EXPECT_NE(store.content_hash(), moment);
    const auto saved = load(folder / "a.loam");
    ASSERT_TRUE(saved.ok()) << saved.error().message;
    EXPECT_EQ(saved->store.content_hash(), moment);
  }
}

TEST(HardCaseIO18, ASecondEditorIsRefusedAndAReaderIsNot) {
  const TemporaryFolder folder;
  const Session session = start(folder / "a.loam");
  ASSERT_TRUE(session->world().store.apply(edit_number(1)).ok());
  ASSERT_TRUE(session->save().ok());
  const auto reader = load(folder / "a.loam");
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->store.content_hash(), session->world().store.content_hash());
  const auto second = SaveSession::open(folder / "a.loam", {});
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("another program"), std::string::npos) << second.error().message;
}

TEST(SaveSession, ARegionThatBecameAirStaysAir) {
  const TemporaryFolder folder;
  {
    const Session session = start(folder / "a.loam");
    EditBatch batch;
    batch.fill({{-256, 0, -256}, {-1, 127, -1}}, kAir);
    ASSERT_TRUE(session->world().store.apply(batch).ok());
    ASSERT_TRUE(session->close().ok());
  }
  const auto again = load(folder / "a.loam");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->store.get({-100, 5, -100}), kAir);
  EXPECT_NE(again->store.get({100, 5, 100}), kAir);
}

TEST(SaveSession, LayersAreWrittenWhereTheyChanged) {
  const TemporaryFolder folder;
  {
    const Session session = start(folder / "a.loam");
    session->world().store.make_layer(Layer::density).set({5, 6, 7}, 0.5f);
    ASSERT_TRUE(session->save().ok());
    session->world().store.make_layer(Layer::density).set({500, 6, 7}, 0.25f);
    ASSERT_TRUE(session->begin_save());
    session->world().store.make_layer(Layer::density).set({5, 6, 7}, 99.0f);  // after the snapshot
    ASSERT_TRUE(session->wait().ok());
    const auto saved = load(folder / "a.loam");
    ASSERT_TRUE(saved.ok()) << saved.error().message;
    EXPECT_EQ(saved->store.find_layer(Layer::density)->get({5, 6, 7}), 0.5f);
    EXPECT_EQ(saved->store.find_layer(Layer::density)->get({500, 6, 7}), 0.25f);
    session->world().store.drop_layer(Layer::density);
    ASSERT_TRUE(session->close().ok());
  }
  const auto again = load(folder / "a.loam");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->store.find_layer(Layer::density), nullptr);
}

TEST(SaveSession, LayersOfIntegersAreWrittenWhereTheyChangedAndGoWhereTheyEmptied) {
  const TemporaryFolder folder;
  const std::array<int32_t, kLeafVoxels> values{-5, 7, 9};
  const auto saved = [&] { return load(folder / "a.loam").value(); };
  {
    const Session session = start(folder / "a.loam");
    IntLayer& liquid = session->world().store.make_int_layer(Layer::liquid);
    liquid.write_leaf({0, 0, 0}, values, kAllMask);
    liquid.write_leaf({70, 0, 0}, values, kAllMask);
    session->world().store.make_layer(Layer::density).set({5, 6, 7}, 0.5f);
    EXPECT_TRUE(session->has_changes());
    ASSERT_TRUE(session->begin_save());
    liquid.set({0, 0, 0}, 1000);  // after the snapshot
    ASSERT_TRUE(session->wait().ok());
    EXPECT_EQ(session->last_report().regions, 0u) << "no blocks changed";
    EXPECT_EQ(saved().store.find_int_layer(Layer::liquid)->get({0, 0, 0}), -5);
    EXPECT_EQ(saved().store.find_layer(Layer::density)->get({5, 6, 7}), 0.5f);
    EXPECT_TRUE(session->has_changes());
    liquid.write_leaf({70, 0, 0}, values, kNoneMask);
    ASSERT_TRUE(session->save().ok());
    EXPECT_FALSE(session->has_changes());
    EXPECT_EQ(saved().store.find_int_layer(Layer::liquid)->get({0, 0, 0}), 1000);
    EXPECT_EQ(saved().store.find_int_layer(Layer::liquid)->regions(), (std::vector<RegionPos>{{0, 0, 0}}));
    session->world().store.drop_layer(Layer::liquid);
    EXPECT_EQ(session->world().store.find_int_layer(Layer::liquid), nullptr);
    ASSERT_TRUE(session->close().ok());
  }
  EXPECT_EQ(saved().store.find_int_layer(Layer::liquid), nullptr);
  EXPECT_NE(saved().store.find_layer(Layer::density), nullptr);
}

TEST(HardCaseIO21, AWriteProtectedSaveIsSaidWhenItIsOpened) {
  if (::getuid() == 0) GTEST_SKIP() << "root may write everything";
  const TemporaryFolder folder;
  start(folder / "a.loam").reset();
  std::filesystem::permissions(folder / "a.loam", std::filesystem::perms::owner_read);
  const auto refused = SaveSession::open(folder / "a.loam", {});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("write"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(load(folder / "a.loam").ok());
}

TEST(SaveSession, AMissingFileBeginsAsAnEmptyWorld) {
  const TemporaryFolder folder;
  const auto session = SaveSession::open(folder / "new.loam", {});
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_EQ((*session)->world().store.voxel_count(), 0u);
  EXPECT_EQ((*session)->world().palette->size(), standard_blocks().size());
}

}  // namespace
}  // namespace world
