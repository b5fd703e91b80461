// browser.js: the page in a real browser: Debian's Chromium, driven by playwright-core. Both are optional: without them the
// test is skipped. Frames per second are not asserted: WebGL runs in software here.
//
//     node test/view/browser.js build/release/bin/omentum scenes
'use strict';

const fs = require('node:fs');
const path = require('node:path');
const program_js = require('./program.js');
const { open, errors } = program_js;

const [, , program, scenes] = process.argv;
const start = (args) => program_js.start(program, args);

function check(is, what) {
  if (!is) throw new Error(what);
  console.log('ok: ' + what);
}

const said = (page) => page.locator('#said').textContent();

// A place of the canvas over the tissue's corner that is nearest to the viewer.
const findCorner = (page) => page.evaluate(() => {
  const box = document.getElementById('canvas').getBoundingClientRect(), part = live.stage.parts[0], v = new THREE.Vector3();
  const ray = new THREE.Raycaster();
  for (let y = 0.9; y > 0.1; y -= 0.02)
    for (let x = 0.1; x < 0.9; x += 0.05) {
      ray.setFromCamera(new THREE.Vector2(2 * x - 1, 1 - 2 * y), live.stage.camera);
      if (ray.intersectObject(part.mesh).length) return [box.left + x * box.width, box.top + (y - 0.03) * box.height];
    }
  return null;
});

async function testHand(browser) {
  const file = path.join(fs.mkdtempSync('/tmp/om_browser_'), 'scene.yaml'), text = fs.readFileSync(path.join(scenes, 'belief.yaml'), 'utf8');
  fs.writeFileSync(file, text);
  const { child, url } = await start([file, '--free', '--port', '0']);
  const page = await open(browser, url, { width: 640, height: 420 });
  await page.waitForFunction(() => window.live && live.mode === 'free' && live.hasControl && live.log.frames.length > 2);
  const before = await page.evaluate(() => Array.from(live.stage.parts[0].mesh.geometry.attributes.position.array));
  const at = await findCorner(page);
  check(at, 'the tissue is on the screen');
  await page.mouse.move(at[0], at[1]);
  await page.mouse.down();
  for (let k = 1; k <= 10; ++k) {
    await page.mouse.move(at[0], at[1] - 6 * k);
    await page.waitForTimeout(50);
  }
  await page.waitForFunction(() => live.log.frames.at(-1).force > 0.01);
  const shown = await page.evaluate(() => {
    live.showForce(live.log.frames.at(-1));
    return [document.getElementById('pull').textContent, live.log.frames.at(-1).force];
  });
  check(Math.abs(parseFloat(shown[0]) - shown[1]) < 0.0051 && / N$/.test(shown[0]), `the force is shown: ${shown[0]}`);
  const moved = await page.evaluate((from) => {
    const x = live.stage.parts[0].mesh.geometry.attributes.position.array;
    return Math.max(...from.map((value, i) => Math.abs(value - x[i])));
  }, before);
  check(moved > 0.005, `the tissue is lifted by ${(1000 * moved).toFixed(0)} mm`);
  await page.mouse.up();
  await page.evaluate(() => live.send('grasp 5 5 5'));  // no tissue there: an answer, and the program stays
  await page.waitForFunction(() => /no free tissue/.test(document.getElementById('said').textContent));
  await page.click('#commands button:has-text("pause")');
  await page.waitForFunction(() => document.getElementById('said').textContent === 'paused');
  for (let last = -1, now = 0; last !== now;) {  // a frame may be on its way still
    last = now;
    await page.waitForTimeout(200);
    now = await page.evaluate(() => live.log.frames.at(-1).time);
  }
  const time = await page.evaluate(() => live.log.frames.at(-1).time);
  await page.click('#commands button:has-text("one step")');
  await page.waitForFunction((t) => live.log.frames.at(-1).time > t, time);
  const after = await page.evaluate(() => live.log.frames.at(-1).time);
  check(Math.abs(after - time - 0.02) < 1e-6, 'one step is one time step');
  await page.locator('#canvas').focus();
  await page.keyboard.press('Space');
  await page.waitForFunction(() => document.getElementById('said').textContent === 'the tissue moves');
  await page.click('#commands button:has-text("reset")');
  await page.waitForFunction(() => document.getElementById('said').textContent === 'back at rest');
  check(await page.evaluate(() => live.hasControl), 'the space bar continues, and a reset keeps the page');
  await page.evaluate(() => document.getElementById('use-keys').click());
  await page.keyboard.press('c');
  check(await page.evaluate(() => live.stage.color === 'plain'), 'shortcuts can be switched off');
  await page.evaluate(() => document.getElementById('use-keys').click());
  await page.keyboard.press('c');
  check(await page.evaluate(() => live.stage.color === 'displacement'), 'and on');
  await page.click('#film');
  await page.waitForTimeout(1000);
  const [video] = await Promise.all([page.waitForEvent('download'), page.click('#film')]);
  check(/\.(webm|mp4)$/.test(video.suggestedFilename()) && fs.statSync(await video.path()).size > 200, `a video is saved: ${video.suggestedFilename()}`);
  await page.fill('#young', '1');
  await page.dispatchEvent('#young', 'change');
  await page.waitForFunction(() => /modulus 6000 Pa/.test(document.getElementById('said').textContent));
  check(true, 'the modulus follows the slider');
  fs.writeFileSync(file, text.replace('young: 3000', 'young: nonsense'));
  await page.waitForFunction(() => /young/.test(document.getElementById('said').textContent));
  fs.writeFileSync(file, text.replace('size_mm: [120, 120, 5]', 'size_mm: [80, 80, 5]'));
  await page.waitForFunction(() => Math.abs(live.log.scene.task.half_size[0] - 0.04) < 1e-6);
  check(true, 'a changed scene is loaded again');
  child.kill('SIGKILL');
  await page.waitForFunction(() => /not there any more/.test(document.getElementById('status').textContent));
  check(true, 'the page says that the program is gone');
  const again = await start([file, '--free', '--port', new URL(url).port]);
  await page.waitForFunction(() => window.live && live.hasControl && live.log.frames.length > 2);
  check(true, 'and goes to the program that is started again');
  fs.rmSync(path.dirname(file), { recursive: true });
  again.child.kill('SIGKILL');
  await page.close();
}

// A box of tetrahedra as a VTK file, in mm: six in each cell. Nothing says how it is held.
function writeBox(file, n, size) {
  const at = (i, j, k) => i + (n[0] + 1) * (j + (n[1] + 1) * k), points = [], cells = [];
  for (let k = 0; k <= n[2]; ++k) for (let j = 0; j <= n[1]; ++j) for (let i = 0; i <= n[0]; ++i) points.push([i, j, k].map((v, d) => v * size[d] / n[d]).join(' '));
  for (let k = 0; k < n[2]; ++k) for (let j = 0; j < n[1]; ++j) for (let i = 0; i < n[0]; ++i) {
    const c = (q) => at(i + (q & 1), j + (q >> 1 & 1), k + (q >> 2));
    for (const t of [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]) cells.push('4 ' + t.map(c).join(' '));
  }
  fs.writeFileSync(file, ['# vtk DataFile Version 3.0', 'box', 'ASCII', 'DATASET UNSTRUCTURED_GRID', `POINTS ${points.length} double`, ...points,
    `CELLS ${cells.length} ${5 * cells.length}`, ...cells, `CELL_TYPES ${cells.length}`, ...cells.map(() => 10), ''].join('\n'));
}

// A mesh without a scene: its lowest layer is held; a ball presses it; law, element and engine are chosen on the page.
async function testMesh(browser) {
  const file = path.join(fs.mkdtempSync('/tmp/om_browser_'), 'box.vtk');
  writeBox(file, [6, 6, 3], [80, 80, 30]);
  const { child, url } = await start([file, '--port', '0']);
  const page = await open(browser, url, { width: 640, height: 420 });
  await page.waitForFunction(() => window.live && live.mode === 'free' && live.hasControl && live.log.frames.length > 2);
  await page.waitForFunction(() => /lowest layer is held/.test(document.getElementById('said').textContent));
  const held = await page.evaluate(() => Array.from(live.stage.dots[0].geometry.attributes.position.array).filter((_, i) => i % 3 === 2));
  check(held.filter((z) => Math.abs(z - held[0]) < 1e-4).length >= 49, 'the 49 vertices of the lowest layer are held');
  await page.waitForFunction(() => / ms$/.test(document.getElementById('fact-rate').textContent));
  check(true, `steps a second are shown: ${await page.locator('#fact-rate').textContent()}`);
  await page.click('#tools button:has-text("press")');
  const at = await page.evaluate(() => {
    scrollTo(0, 0);
    const box = document.getElementById('canvas').getBoundingClientRect(), p = live.stage.parts[0].x;
    let top = new THREE.Vector3(0, 0, -1);
    for (let i = 0; i < p.length; i += 3) {
      const v = new THREE.Vector3(p[i], p[i + 1], p[i + 2]);
      if (Math.hypot(v.x - 0.04, v.y - 0.04) < 0.01 && v.z > top.z) top = v;
    }
    top.project(live.stage.camera);
    return [box.left + (top.x + 1) / 2 * box.width, box.top + (1 - top.y) / 2 * box.height];
  });
  await page.mouse.move(at[0], at[1]);
  await page.mouse.down();
  for (let k = 1; k <= 5; ++k) {
    await page.mouse.move(at[0], at[1] + 5 * k);
    await page.waitForTimeout(50);
  }
  await page.waitForFunction(() => live.log.frames.at(-1).force > 0.05);
  const ball = await page.evaluate(() => {
    const p = live.stage.parts.find((q) => q.kind === 'probe').mesh.geometry.attributes.position.array, x = Array.from(p).filter((_, i) => i % 3 === 0);
    return [Math.max(...x) - Math.min(...x), live.radius];
  });
  check(Math.abs(ball[0] - 2 * ball[1]) < 0.1 * ball[1], `the ball is drawn, ${(500 * ball[0]).toFixed(1)} mm in radius, and pressed by ${await page.locator('#pull').textContent()}`);
  await page.mouse.up();
  await page.waitForFunction(() => live.log.frames.at(-1).force === 0);
  for (const [id, value, words] of [['law', 'st-venant-kirchhoff', /st-venant-kirchhoff/], ['element', 'linear', /st-venant-kirchhoff.*; 196 nodes/], ['engine', 'pbd', /position based|clusters|pbd/i]]) {
    await page.selectOption('#' + id, value);
    await page.waitForFunction((w) => new RegExp(w, 'i').test(document.getElementById('said').textContent), words.source);
    check(true, `${id}: ${await said(page)}`);
  }
  await page.waitForFunction(() => document.querySelector('#tools button:last-child').hidden);
  check(true, 'an engine without a matrix has no probe, and the page does not offer it');
  await page.evaluate(() => live.send('press 0.04 0.04 0.05'));
  await page.waitForFunction(() => /no contact surface/.test(document.getElementById('said').textContent));
  await page.evaluate(() => live.send('law jelly'));
  await page.waitForFunction(() => /jelly/.test(document.getElementById('said').textContent));
  check(true, `an unknown law is answered: ${await said(page)}`);
  fs.rmSync(path.dirname(file), { recursive: true });
  await page.close();
  child.kill('SIGKILL');
}

async function testRun(browser) {
  const { child, url } = await start([path.join(scenes, 'belief.yaml'), '--approve', '--port', '0']);
  const page = await open(browser, url, { width: 400, height: 800 });
  await page.waitForFunction(() => window.live && live.mode === 'run' && live.hasControl);
  const second = await open(browser, url, { width: 400, height: 600 });
  await second.waitForFunction(() => window.live && live.mode);
  check(await second.locator('#watching').isVisible(), 'a second page watches');
  await page.bringToFront();
  const first = await page.evaluate(() => live.plan);
  check(/^[0-9a-f]{16}$/.test(first), `the plan that waits has a name: ${first}`);
  await page.evaluate(() => live.sendRaw('yes'));
  await page.waitForFunction(() => /names no plan/.test(document.getElementById('said').textContent));
  await page.evaluate(() => scrollTo(0, 0));
  const ground = await page.locator('#canvas').boundingBox();
  await page.evaluate(() => { [...document.querySelectorAll('#brush button')].find((b) => b.textContent === 'held here').click(); scrollTo(0, 0); });
  await page.mouse.move(ground.x + ground.width * 0.4, ground.y + ground.height * 0.5);
  await page.mouse.down();
  for (let k = 1; k <= 6; ++k) await page.mouse.move(ground.x + ground.width * (0.4 + 0.04 * k), ground.y + ground.height * 0.5);
  const painted = await page.evaluate(() => live.painted.size);
  check(painted >= 2, `a brush touches ${painted} grasping points`);
  await page.mouse.up();
  await page.waitForFunction((n) => document.getElementById('said').textContent.split('\n').length === n && live.nanswer === 0, painted);
  const answers = (await said(page)).split('\n');
  check(answers.every((a) => /marked|attached|held/i.test(a)), `each mark is answered: ${answers[0]}`);
  await page.waitForFunction((n) => live.story.filter((e) => e.event === 'command').length >= n, painted);
  check(true, 'and stands in the story');
  await page.evaluate(() => { document.querySelector('#brush button').click(); });
  await page.waitForFunction((was) => live.plan && live.plan !== was, first);
  await page.evaluate((was) => live.sendRaw('yes ' + was), first);
  await page.waitForFunction(() => /does not wait any more/.test(document.getElementById('said').textContent));
  check(true, `an old plan is not approved: ${await said(page)}`);
  await page.click('#commands button:has-text("approve")');
  await page.waitForFunction(() => live.log.frames.at(-1).time > 0.3);
  check(true, 'the approved plan begins');
  await page.evaluate(() => scrollTo(0, 0));
  const middle = await page.locator('#canvas').boundingBox();
  await page.mouse.click(middle.x + middle.width / 2, middle.y + middle.height * 0.55);
  await page.waitForFunction(() => !document.getElementById('choices').hidden);
  const point = await page.locator('#choices b').textContent();
  await page.click('#choices button:has-text("do not grasp here")');
  await page.waitForFunction(() => /forbade point/.test(document.getElementById('said').textContent));
  check((await said(page)).includes(point.replace('Point ', 'point ')), `a click forbids: ${await said(page)}`);
  await page.fill('#line', 'forbid 3 2');
  await page.press('#line', 'Enter');
  await page.waitForFunction(() => /forbade point \(3,2\)/.test(document.getElementById('said').textContent));
  await page.fill('#line', 'dance');
  await page.press('#line', 'Enter');
  await page.waitForFunction(() => /is no command/.test(document.getElementById('said').textContent));
  check(true, `what is no command is answered: ${(await said(page)).slice(0, 40)}`);
  await page.reload();
  await page.waitForFunction(() => window.live && live.story.length > 1);
  check(true, 'a page that is loaded again has the whole story');
  const names = await page.evaluate(() => [...document.querySelectorAll('button, input, select, canvas')]
    .filter((e) => !e.textContent.trim() && !e.getAttribute('aria-label') && !e.closest('label') && e.tabIndex >= 0).map((e) => e.id));
  check(names.length === 0, `every control has a name (without: ${names})`);
  await page.close();
  await second.bringToFront();
  await second.waitForFunction(() => live.hasControl);
  check(!await second.locator('#watching').isVisible(), 'the page that watched gets the controls when the first one is closed');
  await second.close();
  child.kill('SIGTERM');
}

program_js.run(async (browser) => {
  await testHand(browser);
  await testMesh(browser);
  await testRun(browser);
  check(errors.length === 0, `no error in the console (${errors.join('; ')})`);
});
