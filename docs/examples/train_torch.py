"""Train a small network: where can one walk, sit and reach, seen only from what people did?

    hsbench generate activity-maps --size small --frames none --out data/maps
    python docs/examples/train_torch.py data/maps

Input: three activity maps. Target: three affordance maps seen from above. A tenth of the work of a paper's method.
"""

import sys

import torch
from torch import nn
from torch.utils.data import DataLoader

from hsbench import load
from hsbench.torch import EpisodeDataset, collate, mirrored

EPOCHS, BATCH, CLASSES = 3, 16, 3  # walkable, sittable, interactable: the first bits of the labels


def target(batch):
    """(B, 3, s, s) one map a class, from the bits of the labels."""
    return torch.stack([batch["affordance"] >> bit & 1 for bit in range(CLASSES)], dim=1).float()


def sometimes_mirrored(sample, rng):
    return mirrored(sample) if rng.random() < 0.5 else sample


def main(folder):
    torch.manual_seed(0)
    fields = ("maps", "affordance")
    train = EpisodeDataset(load(folder, "train", truth=True), sometimes_mirrored, fields)
    val = EpisodeDataset(load(folder, "val", truth=True), fields=fields)
    network = nn.Sequential(
        nn.Conv2d(3, 16, 7, padding=3), nn.ReLU(), nn.Conv2d(16, 32, 7, padding=3), nn.ReLU(), nn.Conv2d(32, CLASSES, 1)
    )
    optimiser = torch.optim.Adam(network.parameters(), 2e-3)
    for epoch in range(EPOCHS):
        for batch in DataLoader(train, BATCH, shuffle=True, collate_fn=collate):
            loss = nn.functional.binary_cross_entropy_with_logits(network(batch["maps"]), target(batch))
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        both = either = torch.zeros(CLASSES)
        with torch.no_grad():
            for batch in DataLoader(val, BATCH, collate_fn=collate):
                said, true = network(batch["maps"]) > 0, target(batch) > 0
                both, either = both + (said & true).sum((0, 2, 3)), either + (said | true).sum((0, 2, 3))
        print(f"epoch {epoch + 1}: loss {loss.item():.3f}, val IoU {[round(v, 3) for v in (both / either).tolist()]}")


if __name__ == "__main__":
    main(sys.argv[1])
