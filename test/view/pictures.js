// pictures.js: the pictures of doc/view.md, made again: pages at the size of a desk and of a phone.
//
//     NODE_PATH=build/node/node_modules node test/view/pictures.js build/release/bin/omentum scenes doc/images [NAME [RUNS]]
//
// It makes the demo and a run with updates first (two minutes on two cores), in a folder of its own. NAME: one picture alone.
// RUNS: a folder that has these runs already, as `demo` and `learnt`.
'use strict';

const { execFileSync } = require('node:child_process');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const { start, open, run, errors } = require('./program.js');

const [, , program, scenes, folder, only, runs] = process.argv;
const DESK = { width: 1100, height: 700 }, PHONE = { width: 390, height: 780 };
const made = fs.mkdtempSync(path.join(os.tmpdir(), 'om_pictures_'));

const make = (name, args) => {
  const out = path.join(runs || made, name);
  if (!fs.existsSync(out))
    try { execFileSync(program, [...args, '-q', '-o', out], { stdio: 'ignore' }); } catch (e) { if (e.status !== 1) throw e; }  // 1: not exposed
  return out;
};
const demo = () => make('demo', ['demo']);
const learnt = () => make('learnt', ['retract', path.join(scenes, 'belief.yaml'), '--defras']);
const press = (page, group, name) => page.evaluate(([g, n]) => [...document.querySelectorAll(`#${g} button`)].find((b) => b.textContent === n).click(), [group, name]);
const top = (page) => page.evaluate(() => scrollTo(0, 0));

async function live(browser, args, size) {
  const { url } = await start(program, [...args, '--port', '0']);
  const page = await open(browser, url, size);
  await page.waitForFunction(() => window.live && live.mode && live.hasControl && live.log.frames.length > 2);
  return page;
}

// Wait for a state of a live page. On a slow machine a page may be silent for two seconds, which pauses its run: it continues here.
async function reach(page, done) {
  for (let k = 0; k < 300; ++k) {
    if (await page.evaluate(done)) return;
    await page.evaluate(() => { if (live.isPaused && live.hasControl) live.send('go'); });
    await page.waitForTimeout(1000);
  }
  throw new Error(`after five minutes: not yet ${done}`);
}

async function recorded(browser, dir, time, size) {
  const page = await open(browser, 'file://' + path.join(dir, 'view.html'), size);
  await page.waitForFunction(() => window.player);
  await page.evaluate((t) => player.goTo(t * player.end), time);
  return page;
}

// Where a point of the tissue's upper side is on the screen: the shares of its box, along and across.
const onTissue = (page, u, v) => page.evaluate(([a, b]) => {
  scrollTo(0, 0);
  const { task } = live.stage.scene, box = document.getElementById('canvas').getBoundingClientRect(), ray = new THREE.Raycaster();
  const p = new THREE.Vector3().fromArray(task.position).addScaledVector(live.stage.turned(1, 0, 0), task.half_size[0] * a)
    .addScaledVector(live.stage.turned(0, 1, 0), task.half_size[1] * b).addScaledVector(live.stage.turned(0, 0, 1), 2 * task.half_size[2]);
  const from = p.clone().addScaledVector(live.stage.turned(0, 0, 1), 0.2);
  ray.set(from, live.stage.turned(0, 0, -1));
  const hit = ray.intersectObject(live.stage.parts[0].mesh)[0], q = (hit ? hit.point : p).project(live.stage.camera);
  return [box.left + (q.x + 1) / 2 * box.width, box.top + (1 - q.y) / 2 * box.height];
}, [u, v]);

async function drag(page, from, to) {
  await page.mouse.move(...from);
  await page.mouse.down();
  for (let k = 1; k <= 12; ++k) {
    await page.mouse.move(from[0] + (to[0] - from[0]) * k / 12, from[1] + (to[1] - from[1]) * k / 12);
    await page.waitForTimeout(60);
  }
  await page.waitForTimeout(1200);
}

const PICTURES = {
  view: async (browser) => {
    const page = await recorded(browser, path.join(demo(), 'run'), 1, DESK);
    await page.evaluate(() => { player.stage.camera.position.copy(player.stage.controls.target).add(player.stage.turned(-0.13, 0.02, 0.075)); player.stage.controls.update(); });
    return page;
  },
  view_recorded_phone: async (browser) => recorded(browser, path.join(demo(), 'run'), 0.92, PHONE),
  view_chances: async (browser) => {
    const page = await recorded(browser, learnt(), 0, DESK);
    const end = await page.evaluate(() => { player.goTo(17); return player.end; });  // s: two after the first estimate is adopted
    if (end < 60) throw new Error(`the run in ${runs || made} ends after ${end.toFixed(1)} s: it was stopped`);
    await press(page, 'colors', 'attachment');
    await press(page, 'shown', 'true attachments');
    for (const name of ['believed attachments', 'pictures']) await press(page, 'shown', name);
    await press(page, 'views', 'below');
    await page.evaluate(() => { player.stage.camera.position.lerp(player.stage.controls.target, 0.3); player.stage.controls.update(); });
    return page;
  },
  view_free: async (browser) => {
    const page = await live(browser, [path.join(demo(), 'model')], DESK);
    const at = await onTissue(page, -0.55, -0.3);
    await press(page, 'colors', 'stress');
    await drag(page, at, [at[0] - 30, at[1] - 130]);
    return page;
  },
  view_press_phone: async (browser) => {
    const page = await live(browser, [path.join(scenes, 'sheet.yaml'), '--free'], PHONE);
    await press(page, 'tools', 'press with a ball');
    await press(page, 'colors', 'contact');
    const at = await onTissue(page, -0.3, -0.3);
    await drag(page, at, [at[0], at[1] + 12]);
    await page.waitForTimeout(3000);  // without a graphics card frames are rare
    return page;
  },
  view_run: async (browser) => {
    const page = await live(browser, [path.join(scenes, 'belief.yaml'), '--approve'], DESK);
    await press(page, 'brush', 'held here');
    await drag(page, await onTissue(page, -0.6, 0.5), await onTissue(page, 0.6, 0.5));
    await page.mouse.up();
    await reach(page, () => live.nanswer === 0 && live.story.length > 3 && live.log.points[0].at(-1).x.length > 0 &&
      document.getElementById('wants').textContent === 'May this plan begin?');
    await page.waitForTimeout(1000);
    return page;
  },
  view_phone: async (browser) => {
    const page = await live(browser, [path.join(scenes, 'belief.yaml'), '--approve'], PHONE);
    await reach(page, () => {
      if (document.getElementById('wants').textContent === 'May this plan begin?') live.send('yes');
      return live.log.frames.at(-1).time > 9;
    });
    return page;
  },
};

run(async (browser) => {
  for (const [name, draw] of Object.entries(PICTURES)) {
    if (only && only !== name) continue;
    const page = await draw(browser);
    await page.waitForTimeout(300);
    await page.screenshot({ path: path.join(folder, name + '.png') });
    await page.close();
    console.log(name);
  }
  if (errors.length) throw new Error(errors.join('; '));
}).finally(() => fs.rmSync(made, { recursive: true, force: true }));
