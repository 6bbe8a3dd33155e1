"""Where can one walk, sit and reach? A small network learns it from what people did, both seen from above.

hsbench generate activity-maps --size small --frames none --out data/maps
python docs/examples/train_torch.py data/maps
"""

import sys

import torch
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits
from torch.utils.data import DataLoader

import hsbench
from hsbench.tasks.probability_maps import LABELS
from hsbench.torch import EpisodeDataset, Sometimes, collate, label_planes, mirrored

EPOCHS, BATCH, WIDTH, POOLED = 5, 16, 24, 4
RARE = torch.tensor([2.0, 6.0, 6.0])[:, None, None]  # few cells afford something: to miss one costs more


def score(answer, episodes):
    """IoU of each label by the task's own scorer; ``answer`` turns maps into probabilities."""
    evaluator = hsbench.Evaluator("affordance-topdown")
    for episode in episodes:
        evaluator.add(episode, answer(episode.activity_maps.maps))
    names, metrics = [label.name.lower() for label in LABELS], evaluator.metrics()
    return ", ".join(f"{name} {metrics[f'{name}/iou'].value:.2f}" for name in names)


torch.manual_seed(0)
train, val = (hsbench.load(sys.argv[1], split, truth=True) for split in ("train", "val"))
rooms = EpisodeDataset(train, Sometimes(mirrored), ("maps", "affordance", "affordance_ignored"))
batches = DataLoader(rooms, BATCH, shuffle=True, collate_fn=collate)

layers = [nn.MaxPool2d(POOLED), nn.Conv2d(len(LABELS), WIDTH, 1)]
for reach in (1, 1, 2, 4, 8):
    layers += [nn.Conv2d(WIDTH, WIDTH, 3, padding=reach, dilation=reach), nn.BatchNorm2d(WIDTH), nn.ReLU()]
network = nn.Sequential(*layers, nn.Conv2d(WIDTH, len(LABELS), 1), nn.Upsample(scale_factor=POOLED))

optimiser = torch.optim.Adam(network.parameters())
pace = torch.optim.lr_scheduler.OneCycleLR(optimiser, 1e-2, epochs=EPOCHS, steps_per_epoch=len(batches))
for epoch in range(EPOCHS):
    for batch in batches:
        target = label_planes(batch["affordance"], LABELS).float()
        counts = (~batch["affordance_ignored"]).float()[:, None]
        loss = binary_cross_entropy_with_logits(network(batch["maps"]), target, counts, pos_weight=RARE)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        pace.step()
    print(f"epoch {epoch + 1}: loss {loss.item():.3f}")

network.eval().requires_grad_(False)
print("val IoU, where people were seen to:", score(lambda maps: maps > 0.02, val))
print("val IoU, network:", score(lambda maps: network(torch.tensor(maps)[None])[0].sigmoid().numpy(), val))
